// SPDX-License-Identifier: Apache-2.0
// Topics that the broker refuses. Each topic is tried again after a pause that doubles up to a minute; messages of
// other topics are still sent.
//
// An MQTT 5 broker refuses a message with a reason. Other brokers just close the connection. From the second close in a
// row on, if it comes soon after the start of the connection, every topic without an acknowledgement is a suspect.
// Suspects are sent one at a time, until the broker has either acknowledged the topic or closed the connection at it.
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
    skip,  // the message is skipped: its topic is refused, and the pause or a trial message is not over
  };
  /// Returns whether a message of `topic` may be sent now. `on_their_way`: number of sent messages without
  /// acknowledgement.
  [[nodiscard]] Verdict verdict(const std::string& topic, std::size_t on_their_way, Time now) const;
  void sent(const std::string& topic);

  /// Records that the broker refused `topic`. Returns whether the refusal or its reason is new.
  bool refuse(const std::string& topic, const std::string& why, Time now);
  /// Records that the broker accepted `topic`. Returns whether the topic was refused before.
  bool take(const std::string& topic);

  void begin_connection();
  /// Records the end of a connection; messages of the topics `on_their_way` were unacknowledged. `soon`: the end came
  /// shortly after the start. Returns the topic that the broker refuses, if its refusal or the reason is new; otherwise
  /// "".
  std::string end_connection(const std::set<std::string>& on_their_way, bool soon, Time now);

  /// Returns whether the pause of a refused topic has ended; true only once for each pause.
  [[nodiscard]] bool take_due(Time now);
  /// Returns a sentence that names one refused topic and the number of the others; "" if no topic is refused.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] bool has_suspects() const { return !suspects_.empty(); }

 private:
  struct Refused {
    std::string why{};
    Time pause{};
    Time retry{};
    bool ends_connection = false;
    bool is_due = false;    // whether the pause of the topic has ended and a message may be sent
    bool is_tried = false;  // whether one message of the refused topic was sent as a trial and is not acknowledged
  };

  std::map<std::string, Refused> refused_;  // refused topics, with the state of each
  std::set<std::string> suspects_;
  bool suspect_is_out_ = false;
  int ends_in_a_row_ = 0;
};

}  // namespace absenc::serve
