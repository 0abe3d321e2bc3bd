// SPDX-License-Identifier: Apache-2.0
// Describes a capture in words: its times, its damage, and the errors of its exchanges.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Converts ticks of a capture to seconds and to text.
class TickClock {
 public:
  /// Takes the tick rate. `ticks_per_second` is 0 for a capture without times; then `text` prints the number of the
  /// tick.
  explicit TickClock(std::uint64_t ticks_per_second);

  [[nodiscard]] bool has_time() const { return ticks_per_second_ != 0; }
  [[nodiscard]] double seconds(capture::Tick tick) const;
  [[nodiscard]] Time time(capture::Tick ticks) const;
  /// Returns the time of a tick in seconds, with the digits that a tick needs; without times, the number of the tick.
  [[nodiscard]] std::string text(capture::Tick tick) const;
  /// Returns the format of a time in seconds for `Column::Presentation`, as "{:.6f}", with the digits that a tick
  /// needs.
  [[nodiscard]] std::string format() const;

 private:
  std::uint64_t ticks_per_second_;
  int digits_ = 0;
};

/// Returns a sentence about damage: "the capture is damaged at byte 600, second 0.005: the file is cut off", or "note:
/// byte 600, ...".
[[nodiscard]] std::string to_text(const capture::Damage& damage, const TickClock& clock);

/// Returns the kind of an annotation as rows name it: "exchange", "request", "reply" or "noise".
[[nodiscard]] std::string_view name_of(capture::Annotation::Kind kind);

/// Returns whether the fields of an annotation may be shown: not if it has an error, is noise, is cut off, or is not
/// documented.
[[nodiscard]] bool has_fields(const capture::Annotation& annotation);

/// Returns the remark of an annotation in words (of a CAN error frame, its meaning) or, without a remark, its error,
/// with advice if there is a reply; "" if it has neither. A good composed frame has a text of its own.
[[nodiscard]] std::string message_of(const Unit& unit, const Options& options, const capture::Annotation& annotation);

}  // namespace absenc::client
