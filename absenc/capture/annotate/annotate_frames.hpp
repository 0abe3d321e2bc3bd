// SPDX-License-Identifier: Apache-2.0
// The annotators of links whose frames need not be found: SPI exchanges and clocked words, and CAN frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/capture/annotate/exchanges.hpp"
#include "absenc/capture/annotate/judge.hpp"

namespace absenc::capture {

/// Control frames of clocked links: the bits that the host says with the level of its clock in each pause, and those of
/// the encoder in the next word. They begin with a 1 behind so many zeros, and end with so many.
class ControlFrames {
 public:
  static constexpr unsigned zeros = 14;

  /// Whether the encoder's bit may be 1: something is asked for.
  [[nodiscard]] bool may_answer() const { return open_; }
  /// The next word, and what was wrong with it. `settle` comes before the next.
  void put(const Burst& burst, bool answered, Error error);
  /// The next word comes, or the end; whether the clock fell before it. True: the word that was put is the last of a
  /// control frame.
  bool settle(bool fell);
  /// The capture ends. True: a control frame goes on.
  bool finish() { return std::exchange(open_, false); }
  /// The one that has ended, decoded; valid until the next word, and until `judge` decodes the next.
  [[nodiscard]] Annotation annotation(Judge& judge) const;

 private:
  struct Bits {
    std::vector<std::uint8_t> bytes;
    std::size_t size = 0;
    void add(bool bit);
    [[nodiscard]] Frame frame() const { return {.bytes = bytes, .bits = size}; }
  };

  // A word whose rest is not over.
  struct Pending {
    Tick begin;
    Tick end;
    bool low_after;
    bool answered;
    Error error;
  };

  std::optional<Pending> pending_;
  Bits asked_;
  Bits answered_;
  Tick begin_ = 0;
  Tick end_ = 0;
  Error error_ = Error::none;
  unsigned quiet_ = 0;
  bool open_ = false;
};

/// SPI exchanges, each a request and its reply, and clocked words, which nobody asks for.
class BurstAnnotator {
 public:
  /// `unit` and `sink` must outlive it.
  BurstAnnotator(const Unit& unit, const Options& options, AnnotationSink& sink) : judge_(unit, options), sink_(sink) {}

  void put(const Burst& burst);
  /// The capture ends here, and with it a control frame that goes on.
  void finish();

 private:
  void decode_exchange(const Burst& burst, Annotation& annotation);
  Error decode_as(const Burst& burst, bool with_last, Frame& word, bool& answered);
  void decode_word(const Burst& burst, Annotation& annotation);
  [[nodiscard]] Frame word_of(const Burst& burst, bool with_last);

  Judge judge_;
  AnnotationSink& sink_;
  std::vector<std::uint8_t> shifted_;   // without the clocks that show the idle line
  std::vector<std::uint8_t> silenced_;  // without the encoder's bit of control communication
  ControlFrames control_;
};

/// CAN frames of any number of nodes, who answer in any order or speak unsolicited.
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
