// SPDX-License-Identifier: Apache-2.0
// Listens on a line, identifies the protocol, and passes the exchanges to a sink.
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
  Receiver::ReceiveEnd end = Receiver::ReceiveEnd::none;
  std::string problem{};      // sentence about the loss of the port; "": it was not lost
  std::uint64_t bytes = 0;    // number of received bytes
  std::uint64_t dropped = 0;  // number of received bytes that were dropped before decoding
};

class TapRun {
 public:
  /// Opens a port with settings, or "-" for standard input. Throws UsageError, os::Failure, Failure.
  TapRun(std::string_view place, TapChoices choices);
  ~TapRun();

  /// Waits until protocol and options are known; returns false if the protocol was not found.
  bool settle(const std::function<void(const std::string&)>& progress);
  /// Starts decoding: exchanges are passed to `sink`, which must outlive the object. Called once.
  void begin(capture::AnnotationSink& sink);
  /// Decodes the next received bytes; returns false at the end.
  bool advance();
  [[nodiscard]] TapOutcome outcome() const;
  /// Makes `advance` soon return false. May be called from any thread after `settle`.
  void cancel();

  [[nodiscard]] bool is_protocol_given() const { return !choices_.protocol.empty(); }
  /// Returns the unit of the protocol; only after `settle` returned true.
  [[nodiscard]] const Unit& unit() const { return *unit_; }
  [[nodiscard]] const Options& options() const { return options_; }
  [[nodiscard]] const Receiver& receiver() const { return *receiver_; }
  /// Returns the candidates of the last search, the likeliest first; none if the protocol was given.
  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }
  [[nodiscard]] std::uint64_t received_bytes() const { return bytes_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Sinks;
  struct LineToTry {
    LineSettings settings;
    // address of the tapped port with the line settings `settings`; nothing for standard input
    std::optional<EncoderAddress> address;
  };

  [[nodiscard]] std::vector<LineToTry> lines_to_try();
  void open(const LineToTry& line);
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
  std::vector<LineToTry> lines_;
  std::unique_ptr<Receiver> receiver_;
  std::unique_ptr<TapRecord> record_;
  std::deque<Received> collected_;  // received bytes that `settle` has kept and `advance` has not decoded yet
  std::optional<Time> first_at_;    // arrival time of the first byte; nothing: no byte has arrived
  capture::Tick now_ = 0;
  std::unique_ptr<Sinks> sinks_;
  std::uint64_t bytes_ = 0;
  std::vector<Candidate> candidates_;
  std::vector<std::string> notes_;
};

}  // namespace absenc::client
