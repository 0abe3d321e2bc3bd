// SPDX-License-Identifier: Apache-2.0
// A capture in words: times, damages, what is wrong with an exchange.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// The time of a tick.
class TickClock {
 public:
  /// 0: there is none, ticks are counted.
  explicit TickClock(std::uint64_t ticks_per_second);

  [[nodiscard]] bool has_time() const { return ticks_per_second_ != 0; }
  [[nodiscard]] double seconds(capture::Tick tick) const;
  [[nodiscard]] Time time(capture::Tick ticks) const;
  /// Seconds with as many digits as it takes, or the number of the tick.
  [[nodiscard]] std::string text(capture::Tick tick) const;
  /// Of seconds, for `Column::Look`.
  [[nodiscard]] std::string format() const;

 private:
  std::uint64_t ticks_per_second_;
  int digits_ = 0;
};

/// "the capture is damaged at byte 600, second 0.005: the file is cut off", or "note: byte 600, ..."
[[nodiscard]] std::string to_text(const capture::Damage& damage, const TickClock& clock);

/// "exchange"
[[nodiscard]] std::string_view name_of(capture::Annotation::Kind kind);

/// Whether its frames say something that may be shown.
[[nodiscard]] bool has_fields(const capture::Annotation& annotation);

/// What is wrong with it and what to try; "" of a good one that needs no words.
[[nodiscard]] std::string message_of(const Unit& unit, const Options& options, const capture::Annotation& annotation);

}  // namespace absenc::client
