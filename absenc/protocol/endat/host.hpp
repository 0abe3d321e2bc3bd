// SPDX-License-Identifier: Apache-2.0
// A conversation that reads the position of an EnDat encoder; it uses no port, clock, heap or texts.
#pragma once

#include <algorithm>
#include <new>

#include "absenc/protocol/endat/protocol.hpp"

namespace absenc::endat {

/// Removes additional information that the format does not ask for, and returns the reading of the reply without it:
/// another host may have selected it, and ends it as it likes.
constexpr Reading drop_unasked(const Format& format, ModeCommand code, Reply& reply) {
  reply.info_count = static_cast<std::uint8_t>(std::min<std::size_t>(reply.info_count, format.infos()));
  return reading_of(format, code, reply);
}

/// How often the position is read, at most, if its error bit is set and no error message explains it.
inline constexpr int most_tries = 3;

/// Conversation that reads the position and, if an error or a warning is set, the alarms.
class ReadPosition : public author::HostOf<Protocol> {
 public:
  /// Reads from an encoder of this format with `request`, which has a position.
  ReadPosition(const Format& format, const Request& request) : HostOf(format), position_request_(request) {
    ask(request);
  }
  [[nodiscard]] const Reading* reading() const final { return has_reading_ ? &reading_ : nullptr; }
  /// Returns the request for the position, even if the alarms were read behind it.
  [[nodiscard]] const Request& request() const { return position_request_; }
  /// Returns the valid reply to the request for the position, with the alarms that were read.
  [[nodiscard]] const Reply& last() const { return reply_; }

 private:
  enum class Stage : std::uint8_t { position, area, errors, warnings };

  void concluded(Error error) final {
    if (error != Error::none) return finish(error, manner().hold);
    switch (stage_) {
      case Stage::position:
        reply_ = HostOf::last();
        new (&reading_) Reading(drop_unasked(format(), position_request_.code, reply_));  // saves a copy
        reading_.latched = begun_at();
        reading_.received = received_at();
        if (reading_.alarms == 0 && reading_.singleturn_valid_bits != 0) break;
        stage_ = Stage::area;
        return ask(alarm_requests[0]);
      case Stage::area:
        stage_ = Stage::errors;
        return ask(alarm_requests[1]);
      case Stage::errors:
        errors_ = HostOf::last().word;
        stage_ = Stage::warnings;
        return ask(alarm_requests[2]);
      case Stage::warnings:
        reply_.alarm_words = AlarmWords{errors_, HostOf::last().word};
        add_alarms(reading_, *reply_.alarm_words);
        // An error bit without an error message may be damage that the checksum misses: the position is read again.
        if ((reading_.alarms & (alarm::errors | alarm::warnings)) == 0 && ++tries_ < most_tries) {
          stage_ = Stage::position;
          return ask(position_request_);
        }
        break;
    }
    has_reading_ = true;
    finish(Error::none);
  }

  Request position_request_;
  Stage stage_ = Stage::position;
  bool has_reading_ = false;
  std::uint8_t tries_ = 0;
  std::uint16_t errors_ = 0;
  Reply reply_{};
  Reading reading_{};
};

}  // namespace absenc::endat
