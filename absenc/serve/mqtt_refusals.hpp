// SPDX-License-Identifier: Apache-2.0
// Topics that the broker refuses. A message of such a topic is sent as a trial after a pause, which doubles up to a
// minute.
//
// Some brokers close the connection instead of refusing a message. Topics of messages that may have caused this are
// suspects: their messages are sent one at a time.
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
    wait,  // the message waits until all messages sent so far are acknowledged
    // the message is skipped: its topic is refused, and the pause is not over or a trial message is not acknowledged
    skip,
  };
  /// Returns whether a message of `topic` may be sent now. `on_their_way`: number of messages sent and not
  /// acknowledged.
  [[nodiscard]] Verdict verdict(const std::string& topic, std::size_t on_their_way, Time now) const;
  void sent(const std::string& topic);

  /// Records that the broker refused `topic`. Returns whether the refusal or its reason is new.
  bool refuse(const std::string& topic, const std::string& why, Time now);
  /// Records that the broker accepted `topic`. Returns whether the topic was refused before.
  bool take(const std::string& topic);

  void begin_connection();
  /// Records that the connection to the broker has ended. `on_their_way`: topics of the messages that were not
  /// acknowledged. `soon`: whether the connection ended soon after its start. Returns a topic that is refused from
  /// now on or for a new reason; "" if there is none.
  std::string end_connection(const std::set<std::string>& on_their_way, bool soon, Time now);

  /// Returns whether the pause of a refused topic has ended; true only once for each pause.
  [[nodiscard]] bool take_due(Time now);
  /// Returns a sentence about the refused topics; "" if there are none.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] bool has_suspects() const { return !suspects_.empty(); }

 private:
  struct Refused {
    std::string why{};
    Time pause{};
    Time retry{};
    bool ends_connection = false;
    bool is_due = false;    // whether `take_due` has reported the end of the pause
    bool is_tried = false;  // whether one message of the refused topic was sent as a trial and is not acknowledged
  };

  std::map<std::string, Refused> refused_;  // refused topics, with the state of each
  std::set<std::string> suspects_;
  bool suspect_is_out_ = false;
  int ends_in_a_row_ = 0;
};

}  // namespace absenc::serve
