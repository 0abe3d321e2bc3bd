// SPDX-License-Identifier: Apache-2.0
// Decodes a capture to annotations: opens it, assigns its channels, and runs the decoders.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/capture/lines/pipeline.hpp"
#include "absenc/capture/signal.hpp"
#include "absenc/client/captures/received_characters.hpp"
#include "absenc/client/decode.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// A capture and its description by the user.
struct CaptureChoices {
  std::string path;  // path of the file; "-": standard input
  // the user's description of the capture; its model and options are ignored
  DecodeChoices how{};
  // characters to decode instead of a file; null: decode the file `path`
  std::shared_ptr<const ReceivedCharacters> received{};
};

struct CaptureOutcome {
  std::string problem;               // why nothing could be decoded; "": no problem
  capture::Tick end = 0;             // tick at which the decoded part of the capture ends
  std::vector<double> baud;          // measured baud rate of each asynchronous line; 0: not known
  std::vector<std::string> carries;  // "D0 is the host's", for both channels whose senders were found
  std::vector<std::string> notes;    // sentences about the capture, for example the baud rate that was detected
  std::vector<capture::Damage> damages;
};

/// Opens the capture and returns its reader. Throws UsageError or Failure.
[[nodiscard]] std::unique_ptr<capture::Reader> open_capture(const CaptureChoices& choices);

class CaptureRun {
 public:
  /// Opens the capture. Throws UsageError or Failure.
  CaptureRun(const Unit& unit, const Options& options, const CaptureChoices& choices);
  ~CaptureRun();

  [[nodiscard]] const Options& options() const { return options_; }
  /// Returns the number of ticks per second of the capture; 0: the capture has no times.
  [[nodiscard]] std::uint64_t ticks_per_second() const;
  /// Returns the options of the unit. Options that the user left open get the values that the frames of the capture
  /// show, where they show one. Call before `run`.
  const Options& settle_options();
  /// Decodes the whole capture into `all`. Calls `progress` with the tick that is reached. Throws UsageError, Failure
  /// and the exceptions of `all` and `progress`.
  CaptureOutcome run(capture::AnnotationSink& all, const std::function<void(capture::Tick)>& progress);

 private:
  // The asynchronous lines of the capture, and the sender on each line.
  struct Lines {
    std::vector<unsigned> channels;
    capture::Annotator::Settings settings;
  };

  [[nodiscard]] Lines find_lines() const;
  struct Speed {
    double baud = 0;  // baud rate of the line; 0: the rate that the level changes suggest
    Parity parity = Parity::none;
  };
  [[nodiscard]] Speed likely_speed(const Lines& lines) const;
  /// Decodes at most `characters` characters of the lines.
  CaptureOutcome decode_lines(capture::Reader& reader, Lines lines, Speed speed, std::size_t characters,
                              capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress) const;
  /// Returns the index of the pause length with which the beginning of the capture decodes best.
  [[nodiscard]] std::size_t likely_pause(std::span<const capture::PauseReading> readings,
                                         std::vector<std::string>& notes) const;
  CaptureOutcome run_characters(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);
  CaptureOutcome run_bursts(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);
  CaptureOutcome run_bytes(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);
  CaptureOutcome run_bus(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);
  CaptureOutcome run_frames(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);

  const Unit& unit_;
  Options options_;
  LineSettings line_;  // baud rate, parity and other settings of the line that follow from the unit and its options
  CaptureChoices choices_;
  std::unique_ptr<capture::Reader> reader_;
};

}  // namespace absenc::client
