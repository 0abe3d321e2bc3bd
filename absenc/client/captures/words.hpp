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
  /// Takes the number of ticks per second; 0 for a capture without times.
  explicit TickClock(std::uint64_t ticks_per_second);

  [[nodiscard]] bool has_time() const { return ticks_per_second_ != 0; }
  [[nodiscard]] double seconds(capture::Tick tick) const;
  [[nodiscard]] Time time(capture::Tick ticks) const;
  /// Returns the time of a tick in seconds; without times, the number of the tick.
  [[nodiscard]] std::string text(capture::Tick tick) const;
  /// Returns the format of a time in seconds for `Column::Presentation`, like "{:.6f}".
  [[nodiscard]] std::string format() const;

 private:
  std::uint64_t ticks_per_second_;
  int digits_ = 0;
};

/// Returns a sentence about a damage or a note, with its place in the file.
[[nodiscard]] std::string to_text(const capture::Damage& damage, const TickClock& clock);

/// Returns the kind of an annotation as rows name it: "exchange", "request", "reply" or "noise".
[[nodiscard]] std::string_view name_of(capture::Annotation::Kind kind);

[[nodiscard]] bool has_fields(const capture::Annotation& annotation);

/// Returns a sentence about the error or remark of the annotation; "" if it has neither.
[[nodiscard]] std::string message_of(const Unit& unit, const Options& options, const capture::Annotation& annotation);

}  // namespace absenc::client
