// SPDX-License-Identifier: Apache-2.0
// Reads positions of T-format encoders: a plain machine without port, clock, heap or texts, for drives that do it ten
// thousand times a second. link/step.hpp says how to run it; unit.cpp has what takes several steps.
#pragma once

#include <optional>

#include "absenc/protocol/author/known.hpp"
#include "absenc/protocol/tformat/frame.hpp"

namespace absenc::tformat {

/// Data IDs 0 to 3. ID 3 carries everything. SF hides over_speed, full_absolute_status and counter_overflow, so
/// unless `known_alarms` (the ALMC of an ID 3 reply since power on) is given, IDs 0 and 1 are preceded by an ID 3,
/// and an alarm that newly appears in their SF is followed by one, whose reply is the result then. Nothing is repeated.
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
    return reading_.singleturn_bits != 0 || reading_.multiturn_bits != 0 ? &reading_ : nullptr;  // of a good end only
  }
  /// Of the last good exchange.
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
    new (&reading_) Reading(to_reading(format(), reply(), known_alarms_));  // made there, not copied
    // The document does not say when the position is taken; the end of the request is the latest it can be.
    reading_.latched = sent_at();
    reading_.received = received_at();
    finish(Error::none);
  }
  void ask_for(DataId id) { ask({id}, author::Manner{}); }

  DataId id_;
  bool part_read_ = false;  // ID 0 or 1 has been answered
  std::optional<std::uint8_t> known_alarms_;
  Reading reading_{};
};

inline constexpr Request everything{DataId::everything};  ///< Request for position, turns, identifier and alarms.
/// Data ID 3 of a format that is known when the program is written: `static constexpr Format format{...};`.
template <const Format& format>
using ReadKnownPosition = author::ReadKnownPosition<Protocol, format, everything>;

}  // namespace absenc::tformat
