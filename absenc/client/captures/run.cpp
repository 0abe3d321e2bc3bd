// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <thread>
#include <utility>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/capture/annotate/annotate_frames.hpp"
#include "absenc/capture/annotate/completed_readings.hpp"
#include "absenc/capture/annotate/composed_frames.hpp"
#include "absenc/capture/files/open.hpp"
#include "absenc/capture/lines/blocks.hpp"
#include "absenc/capture/lines/can_line.hpp"
#include "absenc/capture/lines/pipeline.hpp"
#include "absenc/client/captures/channels.hpp"
#include "absenc/client/captures/stdin_source.hpp"
#include "absenc/client/captures/words.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/file_name.hpp"

namespace absenc::client {

namespace {

using capture::Carries;
using capture::Content;
using capture::DecodedPart;
using capture::Tick;

// Stores an exception until decoding has ended: it must not pass through decoder threads.
class Guard {
 public:
  template <class Work>
  bool operator()(Work&& work) {
    try {
      work();
      return true;
    } catch (...) {
      thrown_ = std::current_exception();
      return false;
    }
  }
  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  std::exception_ptr thrown_;
};

std::string_view parity_name(Parity parity) {
  static constexpr std::array<std::string_view, 3> names{"none", "odd", "even"};
  return names[static_cast<std::size_t>(parity)];
}

unsigned threads() { return std::max(1u, std::thread::hardware_concurrency()); }

[[noreturn]] void refuse(const Unit& unit, std::string_view holds, std::string_view advice) {
  throw UsageError(
      fmt::format("the capture holds {}, but {} is spoken on {}: {}", holds, unit.id, line_of(unit), advice));
}

void require_link(const Unit& unit, Content content) {
  const bool uart = unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
  if (content == Content::frames && unit.link != LinkKind::can) refuse(unit, "CAN frames", "is it another protocol?");
  if (content == Content::bytes && !uart) refuse(unit, "bytes", "record the levels of its wires, or CAN frames");
}

// Returns why nothing was decoded: the first damage of the capture or, without damage, the problem that the decoder
// reported.
std::string why_nothing(const CaptureOutcome& outcome, const TickClock& clock) {
  for (const capture::Damage& damage : outcome.damages) {
    if (!damage.note) return to_text(damage, clock);
  }
  return outcome.problem;
}

// Decodes a CAN bus for capture::BlockRun. Each frame depends on the frames before it, so `guess` does nothing.
struct BusDecoding {
  struct Guess {};

  capture::CanDecoder decoder;
  capture::CanAnnotator& annotator;
  const std::function<void(Tick)>& progress;
  std::vector<capture::CanRecord> frames{};
  Tick end = 0;

  void guess(const capture::Levels&, Guess&) const {}
  bool join(const capture::Levels& levels, Guess&) { return decode(levels); }
  bool decode(const capture::Levels& levels) {
    decoder.decode(levels.changes[0], levels.first, levels.end, frames);
    annotate();
    end = std::max(end, levels.end);
    progress(levels.end);
    return true;
  }
  void annotate() {
    for (const capture::CanRecord& frame : frames) annotator.put(frame);
    frames.clear();
  }
};

// Reads captures whose blocks hold characters or frames and need no decoding.
template <class Take>
void read_all(capture::Reader& reader, Take&& take) {
  capture::Block block;
  while (reader.claim(block)) {
    reader.fill(block);
    take(block);
  }
}

}  // namespace

std::unique_ptr<capture::Reader> open_capture(const CaptureChoices& choices) {
  const capture::OpenChoices how{.channels = choices.how.raw_channels,
                                 .samples_per_second = choices.how.samples_per_second};
  if (choices.received != nullptr) return std::make_unique<ReceivedReader>(choices.received);
  try {
    if (choices.path != "-") return capture::open_capture(os::path_of(choices.path), how);
    auto source = std::make_unique<StdinSource>();
    // Refuses binary captures on standard input: some binary formats are read from the end of the file, and standard
    // input has no known end.
    std::array<std::uint8_t, 64> head{};
    const std::size_t size = source->read(0, head);
    if (how.channels != 0 || std::count(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(size), 0) != 0) {
      throw UsageError("from standard input only text can be read: name the file");
    }
    return capture::open_capture(std::move(source), "standard input", how);
  } catch (const capture::OpenError& error) {
    throw Failure(error.what());
  }
}

CaptureRun::CaptureRun(const Unit& unit, const Options& options, const CaptureChoices& choices)
    : unit_(unit),
      options_(options),
      line_(line_settings(unit, options)),
      choices_(choices),
      reader_(open_capture(choices)) {
  require_link(unit, reader_->layout().content);
}

CaptureRun::~CaptureRun() = default;

std::uint64_t CaptureRun::ticks_per_second() const { return reader_->layout().ticks_per_second; }

CaptureOutcome CaptureRun::run(capture::AnnotationSink& all, const std::function<void(Tick)>& progress) {
  capture::CompletedReadings remembering(unit_, options_, all);
  capture::ComposedFrames sink(unit_, options_, remembering);
  const Content content = reader_->layout().content;
  const bool clocked = host_clocks(unit_.link);
  CaptureOutcome outcome = content == Content::bytes     ? run_bytes(sink, progress)
                           : content == Content::frames  ? run_frames(sink, progress)
                           : clocked                     ? run_bursts(sink, progress)
                           : unit_.link == LinkKind::can ? run_bus(sink, progress)
                                                         : run_characters(sink, progress);
  outcome.damages = reader_->damages();
  if (!outcome.problem.empty()) throw Failure(why_nothing(outcome, TickClock(ticks_per_second())));
  return outcome;
}

CaptureRun::Lines CaptureRun::find_lines() const {
  const WireChannels wires = find_wires(unit_.link, reader_->layout().channels, choices_.how.channels);
  Lines lines;
  for (std::size_t i = 0; i < wires.wires.size(); ++i) {
    if (!wires.wires[i]) continue;
    lines.settings.channels[lines.channels.size()] = i == 0 ? Carries::requests : Carries::replies;
    lines.channels.push_back(*wires.wires[i]);
  }
  const std::size_t count = lines.settings.channel_count = lines.channels.size();
  if (count == 1 && (wires.assumed || unit_.link == LinkKind::half_duplex)) lines.settings.channels[0] = Carries::both;
  if (count == 2 && wires.assumed) lines.settings.channels = {Carries::detect, Carries::detect};
  return lines;
}

CaptureOutcome CaptureRun::decode_lines(capture::Reader& reader, Lines lines, Speed speed, std::size_t characters,
                                        capture::AnnotationSink& sink,
                                        const std::function<void(Tick)>& progress) const {
  std::vector<capture::AsyncLine> settings;
  for (const unsigned channel : lines.channels) {
    settings.push_back(
        {channel,
         {.baud = speed.baud, .parity = speed.parity, .stop_bits = line_.stop_bits, .data_bits = line_.data_bits}});
  }
  CaptureOutcome outcome;
  Guard guard;
  std::unique_ptr<capture::Annotator> annotator;
  const auto take = [&](const DecodedPart& part) {
    const std::size_t count = std::min(characters, part.characters.size());
    characters -= count;
    return guard([&] {
             if (annotator == nullptr) {
               lines.settings.ticks = capture::line_ticks(unit_, part.formats[0].bit, reader.layout().ticks_per_second);
               annotator = std::make_unique<capture::Annotator>(unit_, options_, lines.settings, sink);
             }
             for (const capture::Character& character : part.characters.first(count)) annotator->put(character);
             outcome.end = std::max(outcome.end, part.end);
             progress(part.end);
           }) &&
           characters != 0;
  };
  const capture::AsyncOutcome decoded = capture::decode_async(reader, settings, threads(), take);
  guard.rethrow();
  outcome.problem = decoded.problem;
  outcome.baud = decoded.measured_baud;
  if (annotator == nullptr) return outcome;
  annotator->finish(outcome.end);
  const bool were_found = lines.settings.channels[0] == Carries::detect && lines.channels.size() == 2;
  for (std::size_t i = 0; were_found && i < 2; ++i) {
    const std::string_view whose = annotator->carries(i) == Carries::requests ? "the host's" : "the encoder's";
    outcome.carries.push_back(fmt::format("{} is {}", reader.layout().channels[lines.channels[i]], whose));
  }
  return outcome;
}

CaptureOutcome CaptureRun::run_characters(capture::AnnotationSink& sink, const std::function<void(Tick)>& progress) {
  const Lines lines = find_lines();
  const Speed speed = likely_speed(lines);
  CaptureOutcome outcome = decode_lines(*reader_, lines, speed, SIZE_MAX, sink, progress);
  if (!choices_.how.parity && speed.parity != line_.parity) {
    outcome.notes.push_back(fmt::format("the characters have the parity {}, but those of {} usually {}",
                                        parity_name(speed.parity), unit_.id, parity_name(line_.parity)));
  }
  return outcome;
}

CaptureOutcome CaptureRun::run_bursts(capture::AnnotationSink& sink, const std::function<void(Tick)>& progress) {
  const WireChannels wires = find_wires(unit_.link, reader_->layout().channels, choices_.how.channels);
  const bool spi = unit_.link == LinkKind::spi;
  const bool turns = unit_.link == LinkKind::clocked_bidirectional;
  capture::ClockedLine line{.clock = *wires.wires[0],
                            .in = wires.wires[1],
                            .out = spi || turns ? wires.wires[2] : std::nullopt,
                            .select = spi ? wires.wires[3] : std::nullopt,
                            // On a bidirectional line bits are read at the falling edge of the clock: there both host
                            // and encoder have driven their bit for half a period.
                            .rising = !turns && (line_.spi_mode == 0 || line_.spi_mode == 3),
                            .direction = turns ? wires.wires[3] : std::nullopt,
                            .low_goes_on = turns,
                            .delay = static_cast<Tick>(static_cast<double>(line_.delay.count()) * 1e-9 *
                                                       static_cast<double>(ticks_per_second()))};
  CaptureOutcome outcome;
  Guard guard;
  line.choose = [&](std::span<const capture::PauseReading> readings) { return likely_pause(readings, outcome.notes); };
  capture::BurstAnnotator annotator(unit_, options_, sink);
  const auto take = [&](const DecodedPart& part) {
    return guard([&] {
      for (const capture::Burst& burst : part.bursts) annotator.put(burst);
      outcome.end = std::max(outcome.end, part.end);
      progress(part.end);
    });
  };
  const capture::ClockedOutcome decoded = capture::decode_clocked(*reader_, line, threads(), take);
  guard.rethrow();
  annotator.finish();
  outcome.problem = decoded.problem;
  return outcome;
}

CaptureOutcome CaptureRun::run_bytes(capture::AnnotationSink& sink, const std::function<void(Tick)>& progress) {
  const std::vector<std::string>& channels = reader_->layout().channels;
  capture::Annotator::Settings settings;
  settings.channel_count = std::max<std::size_t>(1, channels.size());
  if (settings.channel_count == 2) settings.channels = {Carries::requests, Carries::replies};
  settings.gap = reader_->layout().arrival_gap;
  settings.by_arrival = settings.gap != 0;
  // A capture with arrival times only may begin inside a frame. Other captures of bytes nearly always begin between two
  // frames.
  settings.begins_silent = !settings.by_arrival;
  CaptureOutcome outcome;
  std::unique_ptr<capture::Annotator> annotator;
  read_all(*reader_, [&](const capture::Block& block) {
    for (const capture::Character& character : block.bytes) {
      if (annotator == nullptr) {
        // In the export of a UART decoder a character lasts from its first data bit to its last.
        const double data_bits = static_cast<double>(character.end - character.begin);
        if (data_bits > 1) settings.ticks = capture::line_ticks(unit_, data_bits / 8, ticks_per_second());
        if (data_bits > 1) settings.ticks.pause += static_cast<Tick>(data_bits / 4);
        annotator = std::make_unique<capture::Annotator>(unit_, options_, settings, sink);
      }
      annotator->put(character);
    }
    outcome.end = std::max(outcome.end, block.end);
    progress(block.end);
  });
  // A log ends at the time of its last line, so a pause is assumed to follow it, which ends the last frame.
  if (annotator != nullptr) annotator->finish(outcome.end + settings.ticks.pause);
  return outcome;
}

// Decodes the levels of a CAN bus from its waveform.
CaptureOutcome CaptureRun::run_bus(capture::AnnotationSink& sink, const std::function<void(Tick)>& progress) {
  const WireChannels wires = find_wires(unit_.link, reader_->layout().channels, choices_.how.channels);
  const double rate = choices_.how.baud > 0 ? choices_.how.baud : static_cast<double>(line_.rate);
  const double bit = static_cast<double>(ticks_per_second()) / rate;
  if (bit < 3) {
    throw Failure(
        fmt::format("{} samples a second are too few for a bus of {:.0f} bit/s: 3 for each bit at least, 8 "
                    "are better",
                    ticks_per_second(), rate));
  }
  CaptureOutcome outcome;
  capture::CanAnnotator annotator(unit_, options_, capture::line_ticks(unit_, bit, ticks_per_second()), sink);
  capture::LevelReader reader(*reader_, {*wires.wires[0]});
  outcome.problem = reader.problem();
  if (!outcome.problem.empty()) return outcome;
  BusDecoding decoding{.decoder = capture::CanDecoder(bit), .annotator = annotator, .progress = progress};
  capture::BlockRun<BusDecoding>(reader, decoding, threads()).run();
  decoding.decoder.finish(decoding.frames);
  decoding.annotate();
  outcome.end = decoding.end;
  annotator.finish(outcome.end);
  return outcome;
}

CaptureOutcome CaptureRun::run_frames(capture::AnnotationSink& sink, const std::function<void(Tick)>& progress) {
  const std::vector<std::string>& channels = reader_->layout().channels;
  std::optional<unsigned> wanted;
  if (choices_.how.channels.size() > 1) throw UsageError("--channel: a CAN interface is one channel");
  if (!choices_.how.channels.empty()) wanted = find_channel(channels, choices_.how.channels[0]);
  const double ticks_per_bit =
      line_.rate == 0 ? 0 : static_cast<double>(ticks_per_second()) / static_cast<double>(line_.rate);
  CaptureOutcome outcome;
  capture::CanAnnotator annotator(unit_, options_, capture::line_ticks(unit_, ticks_per_bit, ticks_per_second()), sink);
  read_all(*reader_, [&](const capture::Block& block) {
    for (const capture::CanRecord& record : block.frames) {
      if (!wanted || record.channel == *wanted) annotator.put(record);
    }
    outcome.end = std::max(outcome.end, block.end);
    progress(block.end);
  });
  annotator.finish(outcome.end);
  return outcome;
}

}  // namespace absenc::client
