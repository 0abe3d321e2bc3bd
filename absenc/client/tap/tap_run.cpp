// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/tap/tap_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/capture/annotate/completed_readings.hpp"
#include "absenc/capture/annotate/composed_frames.hpp"
#include "absenc/client/captures/identify_capture.hpp"
#include "absenc/client/captures/sequence_watch.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/socketcan.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

using namespace std::chrono_literals;

namespace {

// number of received bytes at which the protocol is searched first; each further search needs twice as many
constexpr std::size_t first_search = 64;
// number of received bytes after which the search for the protocol does not improve with further bytes
constexpr std::size_t last_search = 8192;
constexpr std::size_t most_at_other = 2048;  // number of bytes that the search decodes at a baud rate that may be wrong
constexpr Time patience_at_rate = 2s;  // time for which bytes are awaited at one rate before the next rate is tried
constexpr std::size_t enough_to_settle = 600;
constexpr Time time_to_settle = 1s;

bool is_asynchronous(const Unit& unit) {
  return unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
}

// Removes response times from annotations, because arrival times are too coarse for them.
struct Untimed final : capture::AnnotationSink {
  Untimed(TapRecord* of_run, capture::AnnotationSink& next) : record(of_run), sink(next) {}
  void put(const capture::Annotation& annotation) override {
    if (record != nullptr) record->put(annotation);
    capture::Annotation untimed = annotation;
    untimed.turnaround.reset();
    sink.put(untimed);
  }
  TapRecord* record;
  capture::AnnotationSink& sink;
};

}  // namespace

struct TapRun::Sinks {
  Sinks(const Unit& unit, const Options& options, capture::Tick gap, TapRecord* record, capture::AnnotationSink& sink)
      : watched(sink),
        remembering(unit, options, watched),
        following(unit, options, remembering),
        untimed(record, following),
        annotator(unit, options, settings(gap), untimed) {}

  static capture::Annotator::Settings settings(capture::Tick gap) {
    capture::Annotator::Settings settings;
    settings.by_arrival = true;
    settings.gap = gap;
    return settings;
  }

  SequenceWatch watched;
  capture::CompletedReadings remembering;
  capture::ComposedFrames following;
  Untimed untimed;
  capture::Annotator annotator;
};

TapRun::TapRun(std::string_view place, TapChoices choices) : choices_(std::move(choices)) {
  if (choices_.duration > Time{}) end_time_ = os::now() + choices_.duration;
  // Accepts a protocol before the port, "tformat:/dev/ttyUSB0", as other verbs of absenc do.
  const std::string_view first = place.substr(0, place.find(':'));
  if (choices_.protocol.empty() && first.size() < place.size() && find_unit(first) != nullptr) {
    choices_.protocol = first;
    place.remove_prefix(first.size() + 1);
  }
  if (first == "sim") {
    throw UsageError("a virtual encoder inside this command has no line: `absenc emulate` makes one");
  }
  const std::size_t question = std::min(place.find('?'), place.size());
  place_ = place.substr(0, question);
  for (std::string_view rest = place.substr(std::min(question + 1, place.size())); !rest.empty();) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    settings_.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  lines_ = lines_to_try();
  open(lines_.front());
  if (choices_.record.empty()) return;
  std::error_code error;
  if (choices_.replaces && std::filesystem::is_regular_file(os::path_of(choices_.record), error)) {
    std::filesystem::remove(os::path_of(choices_.record), error);
  }
  record_ =
      std::make_unique<TapRecord>(choices_.record, fmt::format("received by absenc tap from {}", receiver_->place()));
}

TapRun::~TapRun() = default;

std::vector<TapRun::LineToTry> TapRun::lines_to_try() {
  if (!choices_.protocol.empty()) {
    unit_ = &require_unit(choices_.protocol);
    if (!is_asynchronous(*unit_)) {
      throw UsageError(fmt::format(
          "{} is spoken on {}: absenc receives bytes of serial lines only, and `absenc decode` takes {}", unit_->id,
          line_of(*unit_), unit_->link == LinkKind::can ? "what candump -L prints from standard input" : "a capture"));
    }
    std::vector<std::string> settings = settings_;
    if (!choices_.model.empty()) settings.push_back("model=" + choices_.model);
    settings.insert(settings.end(), choices_.options.begin(), choices_.options.end());
    if (place_ == "-") {
      options_ = require_options(*unit_, choices_.model, choices_.options);
      return {{line_settings(*unit_, options_), std::nullopt}};
    }
    EncoderAddress address = parse_address(fmt::format("{}:{}", unit_->id, place_), settings);
    options_ = address.options;
    return {{address.line, std::move(address)}};
  }
  if (!choices_.model.empty() || !choices_.options.empty()) {
    throw UsageError("a model and options are those of a protocol: say which, behind the port");
  }
  if (place_ == "-") return {{{}, std::nullopt}};
  const std::vector<std::string> buses = os::can_interfaces();
  if (std::find(buses.begin(), buses.end(), place_) != buses.end()) {
    throw UsageError(
        fmt::format("frames of a CAN interface come from candump: candump -L {} | absenc decode PROTOCOL -", place_));
  }
  std::vector<LineToTry> lines;
  std::optional<UsageError> refusal;
  for (const Unit* unit : all_units()) {
    if (!is_asynchronous(*unit)) continue;
    try {
      EncoderAddress address = parse_address(fmt::format("{}:{}", unit->id, place_), settings_);
      const bool has_rates = address.port_kind == PortKind::serial && !os::is_pseudo_terminal(address.path);
      if (has_rates && address.line.rate == 0) continue;
      const bool known = std::any_of(lines.begin(), lines.end(), [&](const LineToTry& one) {
        return !has_rates || (one.settings.rate == address.line.rate && one.settings.parity == address.line.parity &&
                              one.settings.stop_bits == address.line.stop_bits);
      });
      if (!known) lines.push_back({address.line, std::move(address)});
      // skips units whose encoders cannot be connected to the port, or that do not have its settings
    } catch (const UsageError& error) {
      if (!refusal) refusal = error;
    }
  }
  if (lines.empty()) throw UsageError(*refusal);
  return lines;
}

void TapRun::open(const LineToTry& line) {
  receiver_.reset();  // closes the port before it is opened again, because an open port is locked
  receiver_ = line.address ? std::make_unique<Receiver>(*line.address) : std::make_unique<Receiver>();
  receiver_->start(end_time_);
  collected_.clear();
  bytes_ = 0;
}

void TapRun::cancel() { receiver_->cancel(); }

// ---- Identification of the protocol

std::optional<Received> TapRun::collect(Time deadline) {
  std::optional<Received> received = receiver_->next(deadline);
  if (!received) return received;
  bytes_ += received->bytes.size();
  if (!received->bytes.empty() && !first_at_) first_at_ = received->at;
  collected_.push_back(*received);
  return received;
}

CaptureChoices TapRun::collected() const {
  auto received = std::make_shared<ReceivedCharacters>();
  received->gap = std::max<capture::Tick>(1, arrival_tick(receiver_->latency()));
  for (const Received& one : collected_) {
    if (one.bytes.empty()) continue;
    const capture::Tick at = arrival_tick(one.at - *first_at_);
    for (const std::uint8_t byte : one.bytes) received->characters.push_back({.begin = at, .end = at, .value = byte});
  }
  CaptureChoices choices;
  choices.received = std::move(received);
  return choices;
}

bool TapRun::settle(const std::function<void(const std::string&)>& progress) {
  if (unit_ == nullptr) return identify(progress);
  if (unit_->probe != nullptr) settle_options();
  return true;
}

void TapRun::settle_options() {
  while (bytes_ < enough_to_settle) {
    const Time deadline = first_at_ ? *first_at_ + time_to_settle : never;
    const std::optional<Received> received = collect(deadline);
    if (!received || (first_at_ && received->at >= deadline)) break;
  }
  if (bytes_ != 0) options_ = CaptureRun(*unit_, options_, collected()).settle_options();
}

bool TapRun::identify(const std::function<void(const std::string&)>& progress) {
  for (bool first = true;; first = false) {
    bool has_received = false;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (!first || i != 0) {
        try {
          open(lines_[i]);
        } catch (const os::Failure& failure) {
          if (failure.kind() != os::Failure::Kind::bad_rate) throw;
          if (first) notes_.push_back(failure.what());
          continue;
        }
      }
      if (identify_line(progress)) return true;
      has_received = has_received || bytes_ != 0;
      if (receiver_->end() != Receiver::ReceiveEnd::none) return false;
    }
    if (has_received || lines_.size() == 1) return false;
  }
}

bool TapRun::identify_line(const std::function<void(const std::string&)>& progress) {
  const bool is_only_line = lines_.size() == 1;
  const std::size_t most = is_only_line ? last_search : most_at_other;
  std::size_t next_search = first_search;
  progress(fmt::format("{}: waiting for something to be said", receiver_->place()));
  for (;;) {
    const Time deadline = is_only_line || bytes_ != 0 ? never : os::now() + patience_at_rate;
    const std::optional<Received> received = collect(deadline);
    const bool is_silent = received && received->bytes.empty();
    const bool is_over = !received && (bytes_ != 0 || receiver_->end() != Receiver::ReceiveEnd::none);
    if (bytes_ >= next_search || (bytes_ != 0 && (is_silent || is_over))) {
      if (search(progress)) return true;
      while (next_search <= bytes_) next_search *= 2;
    }
    if (!received || bytes_ >= most) return false;
    if (is_silent && bytes_ != 0 && !is_only_line) return false;
  }
}

bool TapRun::search(const std::function<void(const std::string&)>& progress) {
  CaptureFindings findings = search_capture(
      collected(), [&](const std::string& text) { progress(fmt::format("{} bytes: {}", bytes_, text)); });
  candidates_ = std::move(findings.candidates);
  if (candidates_.empty() || !is_found(candidates_.front())) return false;
  unit_ = candidates_.front().unit;
  options_ = candidates_.front().hypothesis.options;
  return true;
}

// ---- Exchanges of the identified protocol

void TapRun::begin(capture::AnnotationSink& sink) {
  const auto gap = std::max<capture::Tick>(1, arrival_tick(receiver_->latency()));
  sinks_ = std::make_unique<Sinks>(*unit_, options_, gap, record_.get(), sink);
}

bool TapRun::advance() {
  std::optional<Received> received;
  if (!collected_.empty()) {
    received = std::move(collected_.front());
    collected_.pop_front();
  } else {
    received = receiver_->next();
    bytes_ += received ? received->bytes.size() : 0;
  }
  capture::Annotator& annotator = sinks_->annotator;
  if (!received) {
    annotator.finish(now_);
  } else if (received->bytes.empty()) {
    annotator.report_after_silence();
  } else {
    if (!first_at_) first_at_ = received->at;
    now_ = arrival_tick(received->at - *first_at_);
    for (const std::uint8_t byte : received->bytes) annotator.put({.begin = now_, .end = now_, .value = byte});
    annotator.report_complete();
  }
  if (record_ != nullptr) record_->flush();
  return received.has_value();
}

TapOutcome TapRun::outcome() const {
  return {.end = receiver_->end(), .problem = receiver_->problem(), .bytes = bytes_, .dropped = receiver_->dropped()};
}

}  // namespace absenc::client
