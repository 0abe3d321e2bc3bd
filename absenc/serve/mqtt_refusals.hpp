// SPDX-License-Identifier: Apache-2.0
// Topics that the broker does not take. Each is tried again after a pause that doubles; the others go on.
//
// A broker says so by a reason (MQTT 5), or it just ends the connection. Then every topic that was on its way is a
// suspect: from the second such end on, suspects are sent one at a time, each alone, until the broker has taken it or
// ended the connection at it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "absenc/core/time.hpp"

namespace absenc::serve {

class MqttRefusals {
 public:
  enum class Verdict : std::uint8_t {
    send,
    wait,  // until what is on its way has been acknowledged
    skip,  // its pause is not over
  };
  /// `on_their_way`: messages that are not acknowledged yet.
  [[nodiscard]] Verdict verdict(const std::string& topic, std::size_t on_their_way, Time now) const;
  void sent(const std::string& topic);

  /// The broker refused it. Returns whether that is new.
  bool refuse(const std::string& topic, const std::string& why, Time now);
  /// The broker took it. Returns whether it had refused it.
  bool take(const std::string& topic);

  void begin_connection();
  /// The connection ended while these were on their way; `soon`: after a short time. Returns the topic that is now
  /// refused, and was not before; else "".
  std::string end_connection(const std::set<std::string>& on_their_way, bool soon, Time now);

  /// Whether a topic's pause is over and it was not tried since; each is returned once.
  [[nodiscard]] bool take_due(Time now);
  /// A sentence that names the refused topics; "": none is.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] bool has_suspects() const { return !suspects_.empty(); }

 private:
  struct Refused {
    std::string why{};
    Time pause{};
    Time retry{};
    bool ends_connection = false;
    bool is_due = false;    // its pause is over: it is tried
    bool is_tried = false;  // one message of it is on its way
  };

  std::map<std::string, Refused> refused_;  // by topic
  std::set<std::string> suspects_;
  bool suspect_is_out_ = false;
  int ends_in_a_row_ = 0;
};

}  // namespace absenc::serve
