// SPDX-License-Identifier: Apache-2.0
// Annotators for links whose frame boundaries are known: SPI, clocked words, CAN.
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

/// Collects control frames of clocked links (BiSS), which carry one bit of the host in each pause, one bit of the
/// encoder in each word. A frame begins with a 1 of the host behind `zeros` zeros, and ends with `zeros` zeros.
class ControlFrames {
 public:
  static constexpr unsigned zeros = 14;

  /// Returns whether a control frame is in progress, so that the encoder's control bit may be 1.
  [[nodiscard]] bool may_answer() const { return open_; }
  /// Adds a word with the encoder's control bit `answered` and the word's error. Call `settle` before the next word.
  void put(const Burst& burst, bool answered, Error error);
  /// Completes the added word. `fell`: the clock fell in the pause after it, which is the host's bit. Returns whether a
  /// control frame ends with this word.
  bool settle(bool fell);
  /// Ends the capture. Returns true if a control frame was in progress, which stays incomplete.
  bool finish() { return std::exchange(open_, false); }
  /// Returns the last control frame. Valid until `settle` is called or `judge` decodes again.
  [[nodiscard]] Annotation annotation(Judge& judge) const;

 private:
  struct CollectedBits {
    std::vector<std::uint8_t> bytes;
    std::size_t size = 0;
    void add(bool bit);
    [[nodiscard]] Frame frame() const { return {.bytes = bytes, .bits = size}; }
  };

  // A word that was added, but not yet completed by `settle`.
  struct Pending {
    Tick begin;
    Tick end;
    bool low_after;
    bool answered;
    Error error;
  };

  std::optional<Pending> pending_;
  CollectedBits request_bits_;
  CollectedBits reply_bits_;
  Tick begin_ = 0;
  Tick end_ = 0;
  Error error_ = Error::none;
  unsigned zeros_seen_ = 0;
  bool open_ = false;
};

/// Annotates SPI exchanges and clocked words, and the control frames that clocked words carry.
class BurstAnnotator {
 public:
  /// Makes an annotator for captures of `unit`. `unit` and `sink` must outlive the annotator.
  BurstAnnotator(const Unit& unit, const Options& options, AnnotationSink& sink) : judge_(unit, options), sink_(sink) {}

  void put(const Burst& burst);
  /// Ends the capture; a control frame that is in progress is reported as incomplete.
  void finish();

 private:
  void decode_exchange(const Burst& burst, Annotation& annotation);
  void decode_both_ways(const Burst& burst, Annotation& annotation);
  void take_host_wire(const Burst& burst, std::size_t bits);
  Error decode_as(const Burst& burst, bool with_last, Frame& word, bool& answered);
  void decode_word(const Burst& burst, Annotation& annotation);
  [[nodiscard]] Frame word_of(const Burst& burst, bool with_last);

  Judge judge_;
  AnnotationSink& sink_;
  // all bits of a burst (`line_`), those that the host has sent, and those that the encoder has sent
  std::vector<std::uint8_t> line_;
  std::vector<std::uint8_t> request_;
  std::vector<std::uint8_t> reply_;
  std::vector<std::uint8_t> shifted_;  // storage of a word whose bits are not exactly the bits of its burst
  // storage of the last word, with the encoder's control communication bit set to 0
  std::vector<std::uint8_t> silenced_;
  ControlFrames control_;
};

/// Annotates CAN frames of one or several encoders.
class CanAnnotator {
 public:
  CanAnnotator(const Unit& unit, const Options& options, const LineTicks& ticks, AnnotationSink& sink)
      : judge_(unit, options), ticks_(ticks), sink_(sink) {}

  void put(const CanRecord& record);
  /// Ends the capture at `end`; requests without a reply are reported.
  void finish(Tick end);

 private:
  static constexpr std::size_t capacity = 16;

  bool pair_reply(const CanRecord& record);
  bool pair_bad_reply(const CanRecord& record);
  void end_earlier_requests(const CanFrame& request);
  void report_exchange(std::size_t index, const CanRecord& record, Error error);
  CanRecord take(std::size_t index);
  void report(Annotation::Kind kind, const CanRecord& record, Error error, Remark remark,
              const Contents& contents = {});
  void report_unanswered(std::size_t index, Remark remark);

  Judge judge_;
  LineTicks ticks_;
  AnnotationSink& sink_;
  std::array<CanRecord, capacity> requests_{};
  std::size_t request_count_ = 0;
};

}  // namespace absenc::capture
