// SPDX-License-Identifier: Apache-2.0
// Reads positions of T-format encoders: a machine without port, clock, heap or texts, for drives that read ten thousand
// times a second. link/step.hpp shows how to run it; procedures with several steps are in unit.cpp.
#pragma once

#include <optional>

#include "absenc/protocol/author/known.hpp"
#include "absenc/protocol/tformat/frame.hpp"

namespace absenc::tformat {

/// Reads data IDs 0 to 3. ID 3 carries everything. SF hides over_speed, full_absolute_status and counter_overflow, so
/// without `known_alarms` (the ALMC of a reply to ID 3 since power on) IDs 0 and 1 are preceded by an ID 3; and an
/// alarm that newly appears in their SF is followed by an ID 3, whose reply is the result. Nothing is repeated.
class ReadPosition : public author::HostOf<Protocol> {
 public:
  /// Reads from an encoder of this format.
  explicit ReadPosition(const Format& format, DataId id = DataId::everything,
                        std::optional<std::uint8_t> known_alarms = std::nullopt)
      : HostOf(format), id_(id), known_alarms_(known_alarms) {
    const bool alarms_first = (id == DataId::singleturn || id == DataId::multiturn) && !known_alarms;
    ask_for(alarms_first ? DataId::everything : id);
  }
  /// Reads with this request.
  ReadPosition(const Format& format, const Request& request) : ReadPosition(format, request.id) {}

  [[nodiscard]] const Reading* reading() const final {
    // Only after a good end.
    return reading_.singleturn_bits != 0 || reading_.multiturn_bits != 0 ? &reading_ : nullptr;
  }
  /// Returns the reply of the last good exchange.
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
    new (&reading_) Reading(to_reading(format(), reply(), known_alarms_));  // constructed in place, not copied
    // The document does not state when the position is latched; the end of the request is the latest possible time.
    reading_.latched = sent_at();
    reading_.received = received_at();
    finish(Error::none);
  }
  void ask_for(DataId id) { ask({id}, author::Manner{}); }

  DataId id_;
  bool part_read_ = false;  // ID 0 or 1 was answered
  std::optional<std::uint8_t> known_alarms_;
  Reading reading_{};
};

inline constexpr Request everything{DataId::everything};  ///< Request for position, turns, identifier and alarms.
/// Reads data ID 3 with a format known when the program is written: `static constexpr Format format{...};`.
template <const Format& format>
using ReadKnownPosition = author::ReadKnownPosition<Protocol, format, everything>;

}  // namespace absenc::tformat
