// SPDX-License-Identifier: Apache-2.0
// Conversations that read positions of T-format encoders; they use no port, clock, heap or texts.
#pragma once

#include <optional>

#include "absenc/protocol/author/known.hpp"
#include "absenc/protocol/tformat/frame.hpp"

namespace absenc::tformat {

/// Conversation that reads with one of the data IDs 0 to 3. With ID 0 or 1 it also sends a request with ID 3 if it
/// needs alarms that the reply does not report. `known_alarms`: alarms (ALMC) of a reply to ID 3 since power on.
class ReadPosition : public author::HostOf<Protocol> {
 public:
  /// Creates a conversation that uses the data ID `id` to read from an encoder of this format.
  explicit ReadPosition(const Format& format, DataId id = DataId::everything,
                        std::optional<std::uint8_t> known_alarms = std::nullopt)
      : HostOf(format), id_(id), known_alarms_(known_alarms) {
    const bool alarms_first = (id == DataId::singleturn || id == DataId::multiturn) && !known_alarms;
    ask_for(alarms_first ? DataId::everything : id);
  }
  /// Creates a conversation that uses the data ID of `request` to read from an encoder of this format.
  ReadPosition(const Format& format, const Request& request) : ReadPosition(format, request.id) {}

  [[nodiscard]] const Reading* reading() const final {
    // The reading is empty until the conversation has ended successfully.
    return reading_.singleturn_bits != 0 || reading_.multiturn_bits != 0 ? &reading_ : nullptr;
  }
  /// Returns the last valid reply.
  [[nodiscard]] const Reply& reply() const { return last(); }

 private:
  void concluded(Error error) final {
    if (error != Error::none) return finish(error);
    if (reply().id == DataId::everything) {
      known_alarms_ = reply().alarms;
      if (id_ != DataId::everything && !part_read_) return ask_for(id_);
    } else if (id_ != DataId::encoder_id) {
      part_read_ = true;
      const int unknown = reply().status & ~status_for(known_alarms_.value_or(0));
      if (unknown != 0) return ask_for(DataId::everything);
    }
    // the reading is constructed in place, because a copy costs time
    new (&reading_) Reading(to_reading(format(), reply(), known_alarms_));
    // The document does not state when the position is latched, so the end of the request is taken as this time.
    reading_.latched = sent_at();
    reading_.received = received_at();
    finish(Error::none);
  }
  void ask_for(DataId id) { ask({id}, author::Manner{}); }

  DataId id_;
  bool part_read_ = false;  // whether the encoder has answered a request with ID 0 or 1
  std::optional<std::uint8_t> known_alarms_;
  Reading reading_{};
};

/// Request with data ID 3: position, turns, encoder id and alarms.
inline constexpr Request everything{DataId::everything};
/// Conversation that reads with data ID 3 and a format that is known at compile time.
template <const Format& format>
using ReadKnownPosition = author::ReadKnownPosition<Protocol, format, everything>;

}  // namespace absenc::tformat
