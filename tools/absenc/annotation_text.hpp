// SPDX-License-Identifier: Apache-2.0
// Annotations of a capture for people, as JSON and as CSV, one a line.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::tool {

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

 private:
  std::uint64_t ticks_per_second_;
  int digits_ = 0;
};

/// "the capture is damaged at byte 600, second 0.005: the file is cut off", or "note: byte 600, ..."
[[nodiscard]] std::string to_text(const capture::Damage& damage, const TickClock& clock);

/// "exchange"
[[nodiscard]] std::string_view name_of(capture::Annotation::Kind kind);

/// What is wrong with it and what to try; "" of a good one that needs no words.
[[nodiscard]] std::string message_of(const Unit& unit, const Options& options, const capture::Annotation& annotation);

enum class AnnotationFormat : std::uint8_t { text, json, csv };
enum class ShowBits : std::uint8_t { no, yes };  // where in the reply its fields stand

/// Prints each annotation as it comes; many at a time where nobody waits for them.
class AnnotationPrinter final : public capture::AnnotationSink {
 public:
  AnnotationPrinter(const Unit& unit, const Options& options, const TickClock& clock, AnnotationFormat format,
                    ShowBits bits = ShowBits::no);

  void put(const capture::Annotation& annotation) override;
  /// Prints what is still kept. Throws OutputClosed, ToolFailure.
  void flush();

 private:
  [[nodiscard]] std::string text(const capture::Annotation& annotation) const;
  [[nodiscard]] std::string json(const capture::Annotation& annotation) const;
  [[nodiscard]] std::string csv(const capture::Annotation& annotation) const;

  const Unit& unit_;
  const Options& options_;
  TickClock clock_;
  AnnotationFormat format_;
  ShowBits bits_;
  std::string kept_;
};

}  // namespace absenc::tool
