// SPDX-License-Identifier: Apache-2.0
// Statistics of a capture: counts, errors, response times, movement of the position.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/captures/position_trace.hpp"
#include "absenc/client/captures/run.hpp"
#include "absenc/client/text/json.hpp"
#include "absenc/host/statistics.hpp"
#include "absenc/protocol/unit.hpp"
#include "tools/absenc/text/annotation_text.hpp"

namespace absenc::tool {

using namespace client;

/// A histogram of durations with four bins for each power of two.
class TimeHistogram {
 public:
  struct Bar {
    Time least;
    Time most;
    std::uint64_t count;
  };

  void add(Time time) {
    const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(time.count(), 1));
    const auto top = static_cast<unsigned>(std::bit_width(value)) - 1;
    const auto quarter = static_cast<unsigned>(top >= 2 ? value >> (top - 2) & 3 : value << (2 - top) & 3);
    ++counts_[4 * top + quarter];
  }
  /// Returns at most `most` bins, from the shortest to the longest duration.
  [[nodiscard]] std::vector<Bar> bars(std::size_t most) const;

 private:
  std::array<std::uint64_t, 256> counts_{};
};

class CaptureStatistics final : public capture::AnnotationSink {
 public:
  CaptureStatistics(const Unit& unit, const Options& options, const TickClock& clock);

  void put(const capture::Annotation& annotation) override;

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] std::uint64_t errors() const { return errors_; }
  /// Returns the number of annotations that have no error and are not cut off by the begin or end of the capture.
  [[nodiscard]] std::uint64_t good() const { return count_ - errors_ - cut_; }

  [[nodiscard]] std::string text(const CaptureOutcome& outcome) const;
  [[nodiscard]] Json json(const CaptureOutcome& outcome) const;

 private:
  static constexpr std::size_t most_kept = 8;
  static constexpr std::size_t error_kinds = error_texts.size();

  // A copy of an annotation with an error; long requests and replies are cut.
  struct StoredError {
    capture::Annotation annotation{};
    ByteBuffer<32> request{};
    ByteBuffer<96> reply{};
    CanFrame request_can{};
    CanFrame reply_can{};
  };
  struct ErrorRun {
    std::uint64_t count = 0;
    capture::Tick begin = 0;
    capture::Tick end = 0;
  };

  void put_error(const capture::Annotation& annotation);
  void keep(const capture::Annotation& annotation, StoredError& kept) const;
  [[nodiscard]] capture::Annotation restored(const StoredError& kept) const;
  [[nodiscard]] Time span() const;
  [[nodiscard]] double per_second() const;

  [[nodiscard]] std::string counts_text(const CaptureOutcome& outcome) const;
  [[nodiscard]] std::string turnaround_text() const;
  [[nodiscard]] std::string errors_text() const;
  [[nodiscard]] std::string error_line(const StoredError& kept) const;

  const Unit& unit_;
  const Options& options_;
  TickClock clock_;
  std::uint64_t count_ = 0;
  std::uint64_t errors_ = 0;
  std::uint64_t cut_ = 0;
  std::uint64_t composed_ = 0;            // number of frames whose bytes were spread over several exchanges
  std::array<std::uint64_t, 4> kinds_{};  // number of annotations of each kind, without the composed frames
  std::array<std::uint64_t, error_kinds> by_error_{};
  std::uint64_t echoes_ = 0;
  std::uint64_t repeated_ = 0;
  capture::Tick begin_ = 0;
  capture::Tick end_ = 0;
  host::Latencies turnarounds_;
  TimeHistogram histogram_;
  Time shortest_ = never;
  PositionTrace trace_;
  std::array<StoredError, most_kept> first_{};
  std::size_t first_count_ = 0;
  std::array<StoredError, error_kinds> first_of_kind_{};
  ErrorRun error_run_;
  ErrorRun longest_error_run_;
};

}  // namespace absenc::tool
