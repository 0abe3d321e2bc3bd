// SPDX-License-Identifier: Apache-2.0
// From a capture to its annotations: opens it, finds which channel is which, and sends all of it through the decoders.
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

/// A capture, and what is said of it.
struct CaptureChoices {
  std::string path;     // "-": standard input
  DecodeChoices how{};  // its model and options are not looked at: they are given as Options
  std::shared_ptr<const ReceivedCharacters> received{};  // in place of a file
};

struct CaptureOutcome {
  std::string problem;               // why nothing could be decoded; "": it could
  capture::Tick end = 0;             // of what was decoded
  std::vector<double> baud;          // measured, of each asynchronous line
  std::vector<std::string> carries;  // "D0 carries requests", where it was found out
  std::vector<std::string> notes;    // sentences: what else was found out
  std::vector<capture::Damage> damages;
};

/// Throws UsageError, Failure.
[[nodiscard]] std::unique_ptr<capture::Reader> open_capture(const CaptureChoices& choices);

class CaptureRun {
 public:
  /// Opens it. Throws UsageError, Failure.
  CaptureRun(const Unit& unit, const Options& options, const CaptureChoices& choices);
  ~CaptureRun();

  [[nodiscard]] const Options& options() const { return options_; }
  /// 0: the capture has no times.
  [[nodiscard]] std::uint64_t ticks_per_second() const;
  /// What the user did not say and only the encoder could be asked for, taken from the frames of the capture; the
  /// options with it. Before anything is decoded: where only a checksum tells a length, the first that fits may be an
  /// accident. Not from standard input, which can be read once only.
  const Options& settle_options();
  /// Decodes all of it into `sink`; `progress` is called now and then with how far it is. Throws UsageError,
  /// Failure and what `sink` throws.
  CaptureOutcome run(capture::AnnotationSink& all, const std::function<void(capture::Tick)>& progress);

 private:
  // The lines of the capture and who speaks on them.
  struct Lines {
    std::vector<unsigned> channels;
    capture::Annotator::Settings settings;
  };

  [[nodiscard]] Lines find_lines() const;
  struct Speed {
    double baud = 0;  // 0: that which the changes suggest
    Parity parity = Parity::none;
  };
  [[nodiscard]] Speed likely_speed(const Lines& lines) const;
  /// At most so many characters.
  CaptureOutcome decode_lines(capture::Reader& reader, Lines lines, Speed speed, std::size_t characters,
                              capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress) const;
  /// Returns the pause that reads the beginning of the capture best, by its index.
  [[nodiscard]] std::size_t likely_pause(std::span<const capture::PauseReading> readings,
                                         std::vector<std::string>& notes) const;
  CaptureOutcome run_characters(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);
  CaptureOutcome run_bursts(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);
  CaptureOutcome run_bytes(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);
  CaptureOutcome run_bus(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);
  CaptureOutcome run_frames(capture::AnnotationSink& sink, const std::function<void(capture::Tick)>& progress);

  const Unit& unit_;
  Options options_;
  LineSettings line_;  // as the options describe it
  CaptureChoices choices_;
  std::unique_ptr<capture::Reader> reader_;
};

}  // namespace absenc::client
