// SPDX-License-Identifier: Apache-2.0
// Listens on a line: receives bytes, finds the protocol where none was given, and hands out exchanges as they come.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/captures/run.hpp"
#include "absenc/client/identify/candidate.hpp"
#include "absenc/client/tap.hpp"
#include "absenc/client/tap/receiver.hpp"
#include "absenc/client/tap/tap_record.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

struct TapOutcome {
  Receiver::End end = Receiver::End::none;
  std::string problem{};      // why the port was lost
  std::uint64_t bytes = 0;    // received
  std::uint64_t dropped = 0;  // received, but not looked at
};

class TapRun {
 public:
  /// `place` is a port without its protocol, with settings behind ?: "/dev/ttyUSB0?baud=115200", "tcp:HOST:PORT"; "-"
  /// is standard input. Opens it. Throws UsageError, os::Failure.
  TapRun(std::string_view place, TapChoices choices);
  ~TapRun();

  /// Waits for enough bytes to say which protocol it is, with which options. False: none explains what came, or nothing
  /// did. Where the protocol was given, only options that nobody gave are found out. Before `run`.
  bool settle(const std::function<void(const std::string&)>& progress);
  /// From now on exchanges go to `sink`, which must outlive it. Once.
  void begin(capture::AnnotationSink& sink);
  /// Waits until something comes, or nothing did for `Receiver::quiet`, and hands out what is whole then. False: that
  /// was the end. Throws os::Failure of the record, and what the sink throws.
  bool advance();
  /// Behind the end.
  [[nodiscard]] TapOutcome outcome() const;
  /// From any thread, behind `settle`: `advance` ends.
  void cancel();

  [[nodiscard]] bool is_protocol_given() const { return !choices_.protocol.empty(); }
  /// Once it is known.
  [[nodiscard]] const Unit& unit() const { return *unit_; }
  [[nodiscard]] const Options& options() const { return options_; }
  [[nodiscard]] const Receiver& receiver() const { return *receiver_; }
  /// Where nobody said the protocol: the likeliest first.
  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }
  [[nodiscard]] std::uint64_t received_bytes() const { return bytes_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Sinks;
  struct Line {
    LineSettings settings;
    std::optional<EncoderAddress> address;  // none: standard input
  };

  [[nodiscard]] std::vector<Line> lines_to_try();
  void open(const Line& line);
  std::optional<Received> collect(Time deadline);
  [[nodiscard]] CaptureChoices collected() const;
  bool identify(const std::function<void(const std::string&)>& progress);
  bool identify_line(const std::function<void(const std::string&)>& progress);
  bool search(const std::function<void(const std::string&)>& progress);
  void settle_options();

  std::string place_;
  std::vector<std::string> settings_;
  TapChoices choices_;
  Time end_time_ = never;
  const Unit* unit_ = nullptr;
  Options options_{};
  std::vector<Line> lines_;
  std::unique_ptr<Receiver> receiver_;
  std::unique_ptr<TapRecord> record_;
  std::deque<Received> collected_;  // while it is found out whose they are
  std::optional<Time> first_at_;    // when the first byte came
  capture::Tick now_ = 0;
  std::unique_ptr<Sinks> sinks_;
  std::uint64_t bytes_ = 0;
  std::vector<Candidate> candidates_;
  std::vector<std::string> notes_;
};

}  // namespace absenc::client
