// SPDX-License-Identifier: Apache-2.0
// The annotators of links whose frames need not be found: SPI exchanges and clocked words, and CAN frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/capture/annotate/exchanges.hpp"
#include "absenc/capture/annotate/judge.hpp"

namespace absenc::capture {

/// SPI exchanges, each a request and its reply, and clocked words, which nobody asks for.
class BurstAnnotator {
 public:
  /// `unit` and `sink` must outlive it.
  BurstAnnotator(const Unit& unit, const Options& options, AnnotationSink& sink) : judge_(unit, options), sink_(sink) {}

  void put(const Burst& burst);

 private:
  void decode_exchange(const Burst& burst, Annotation& annotation);
  [[nodiscard]] Frame word_of(const Burst& burst);

  Judge judge_;
  AnnotationSink& sink_;
  std::vector<std::uint8_t> shifted_;  // without the clocks that show the idle line
};

/// CAN frames of any number of nodes, who answer in any order or speak unasked.
class CanAnnotator {
 public:
  CanAnnotator(const Unit& unit, const Options& options, const LineTicks& ticks, AnnotationSink& sink)
      : judge_(unit, options), ticks_(ticks), sink_(sink) {}

  void put(const CanRecord& record);
  /// The capture ends here.
  void finish(Tick end);

 private:
  static constexpr std::size_t capacity = 16;

  bool answers(const CanRecord& record);
  bool answers_badly(const CanRecord& record);
  void end_waits(const CanFrame& request);
  void answer(std::size_t index, const CanRecord& record, Error error);
  CanRecord take(std::size_t index);
  void tell(Annotation::Kind kind, const CanRecord& record, Error error, Remark remark, const Contents& contents = {});
  void give_up(std::size_t index, Remark remark);

  Judge judge_;
  LineTicks ticks_;
  AnnotationSink& sink_;
  std::array<CanRecord, capacity> asked_{};
  std::size_t waiting_ = 0;
};

}  // namespace absenc::capture
