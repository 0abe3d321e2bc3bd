// SPDX-License-Identifier: Apache-2.0
// Finds properties of the line and the encoder by reading the beginning of a capture.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "absenc/capture/annotate/annotate_frames.hpp"
#include "absenc/client/captures/run.hpp"
#include "absenc/client/captures/words.hpp"

namespace absenc::client {

namespace {

using capture::Tick;

// Counts the good frames, the unanswered requests and the frames with damaged characters of a part of a capture.
struct FrameCounts final : capture::AnnotationSink {
  void put(const capture::Annotation& annotation) override {
    if (annotation.remark == capture::Remark::damaged) ++damaged;
    if (annotation.remark == capture::Remark::unanswered && annotation.error == Error::timeout) ++unanswered;
    if (annotation.error != Error::none || annotation.remark == capture::Remark::cut) return;
    if (annotation.kind == capture::Annotation::Kind::request) return;
    ++good;
  }
  std::uint64_t good = 0;
  std::uint64_t unanswered = 0;
  std::uint64_t damaged = 0;
};

// Returns whether the line seems to carry requests without replies at the unit's own baud rate.
bool reads_silence(const FrameCounts& at_own, const FrameCounts& at_other) {
  return at_own.damaged == 0 && at_own.unanswered > at_other.unanswered &&
         at_other.good <= std::min(at_other.damaged, at_own.unanswered);
}

/// Collects good replies with their requests, and stops the decoding when it has collected enough replies.
struct GoodReplies final : capture::AnnotationSink {
  struct Enough {};

  void put(const capture::Annotation& annotation) override {
    if (annotation.error != Error::none || annotation.reply.empty() || annotation.composed) return;
    frames.push_back({{annotation.request.bytes.begin(), annotation.request.bytes.end()},
                      {annotation.reply.bytes.begin(), annotation.reply.bytes.end()}});
    if (frames.size() == enough) throw Enough{};
  }
  [[nodiscard]] std::vector<Capture> captures() const {
    std::vector<Capture> all;
    for (const auto& [request, reply] : frames) all.push_back({request, reply});
    return all;
  }

  static constexpr std::size_t enough = 1000;
  std::vector<std::pair<std::vector<std::uint8_t>, std::vector<std::uint8_t>>> frames;
};

/// Collects, for each option, the values for or against which the frames give evidence.
struct Possible final : EvidenceSink {
  void put(const OptionEvidence& evidence) override { values.insert({evidence.option, evidence.value}); }
  [[nodiscard]] bool is_open(std::size_t option, std::int64_t value) const {
    const auto first = values.lower_bound({option, INT64_MIN});
    return first != values.end() && first->first == option && !values.contains({option, value});
  }
  std::set<std::pair<std::size_t, std::int64_t>> values;
};

}  // namespace

// Selects baud rate and parity where the user left them open.
CaptureRun::Speed CaptureRun::likely_speed(const Lines& lines) const {
  constexpr std::size_t enough_characters = 20'000;
  Speed best{choices_.how.baud, choices_.how.parity.value_or(line_.parity)};
  if (choices_.path == "-") return best;
  const auto frames_at = [&](const Speed& speed) {
    FrameCounts frames;
    const auto reader = open_capture(choices_);
    static_cast<void>(decode_lines(*reader, lines, speed, enough_characters, frames, [](Tick) {}));
    return frames;
  };
  const bool rate_is_open = choices_.how.baud == 0 && line_.rate != 0;
  if (!rate_is_open && choices_.how.parity) return best;
  FrameCounts at_best = frames_at(best);
  const auto try_at = [&](const Speed& speed, std::uint64_t handicap) {
    const FrameCounts frames = frames_at(speed);
    const bool is_own = speed.baud == line_.rate && speed.parity == line_.parity;
    const bool is_better = frames.good >= std::max<std::uint64_t>(1, at_best.good + handicap);
    if (!is_better && !(is_own && reads_silence(frames, at_best))) return;
    best = speed;
    at_best = frames;
  };
  if (rate_is_open) try_at({static_cast<double>(line_.rate), best.parity}, 0);
  if (choices_.how.parity || (at_best.damaged == 0 && at_best.good + at_best.unanswered != 0)) return best;
  for (const Parity parity : {Parity::none, Parity::odd, Parity::even}) {
    if (parity == line_.parity) continue;
    if (rate_is_open) try_at({static_cast<double>(line_.rate), parity}, 1);
    try_at({choices_.how.baud, parity}, 1);
  }
  return best;
}

// Selects the pause that ends a word. A clock may also pause within words, as between the bytes of a host that sends
// eight bits at a time.
std::size_t CaptureRun::likely_pause(std::span<const capture::PauseReading> readings,
                                     std::vector<std::string>& notes) const {
  struct Words final : capture::AnnotationSink {
    void put(const capture::Annotation& annotation) override {
      if (annotation.remark == capture::Remark::cut) return;
      const bool is_good = annotation.error == Error::none;
      ++(is_good ? good : bad);
      const auto flip = [&](std::size_t bit) {
        return unit.is_checked == nullptr || unit.is_checked(options, annotation.request, annotation.reply, bit);
      };
      const std::size_t last = std::max<std::size_t>(annotation.reply.bits, 1) - 1;
      is_proved = is_proved || (is_good && flip(last));
    }
    const Unit& unit;
    const Options& options;
    std::uint64_t good = 0;
    std::uint64_t bad = 0;
    bool is_proved = false;  // whether at least one good word has a checksum that covers its last bit

    Words(const Unit& unit_of, const Options& with) : unit(unit_of), options(with) {}
  };
  std::size_t best = 0;
  std::uint64_t most = 0;
  std::vector<std::size_t> faultless;
  bool is_proved = false;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    Words words(unit_, options_);
    capture::BurstAnnotator annotator(unit_, options_, words);
    for (const capture::Burst& burst : readings[i].bursts) annotator.put(burst);
    annotator.finish();
    is_proved = is_proved || words.is_proved;
    if (words.bad == 0 && words.good > 1) faultless.push_back(i);
    // Compares good frames only: a longer pause may give fewer bad frames just because it joins a silent word to the
    // next one.
    if (i > 0 && words.good <= most) continue;
    best = i;
    most = words.good;
  }
  const auto differs = [&](std::size_t i) { return readings[i].bursts.size() != readings[best].bursts.size(); };
  const auto other = std::find_if(faultless.begin(), faultless.end(), differs);
  if (other == faultless.end() || is_proved) return best;
  // Prefers a pause length with which the data line changes in every pause between words: the encoder then timed out
  // after each word. Without a timeout it would continue the old word.
  const auto shown =
      std::find_if(faultless.begin(), faultless.end(), [&](std::size_t i) { return readings[i].timed_out; });
  if (shown != faultless.end()) return *shown;
  const auto length = [clock = TickClock(ticks_per_second())](const capture::PauseReading& reading) {
    const std::string ticks = clock.has_time() ? fmt::format("{:g} us", clock.seconds(reading.pause) * 1e6)
                                               : fmt::format("{} ticks", reading.pause);
    return ticks + (reading.by_change ? ", or in which the data line changes" : "");
  };
  notes.push_back(fmt::format(
      "a word is taken to end where the clock rests for more than {}, which makes {} words of the beginning; {} would "
      "make {}, and nothing in a word without a check says which is right",
      length(readings[best]), readings[best].bursts.size(), length(readings[*other]), readings[*other].bursts.size()));
  return best;
}

const Options& CaptureRun::settle_options() {
  if (unit_.probe == nullptr || choices_.path == "-") return options_;
  GoodReplies sample;
  try {
    static_cast<void>(CaptureRun(unit_, options_, choices_).run(sample, [](Tick) {}));
  } catch (const GoodReplies::Enough&) {
  }
  const std::vector<Capture> captures = sample.captures();
  Possible possible;
  Options told = options_;
  if (!unit_.probe(told, captures, possible)) return options_;
  for (std::size_t i = 0; i < unit_.options.size(); ++i) {
    if (possible.is_open(i, options_[i])) options_.values[i] = told[i];
  }
  return options_;
}

}  // namespace absenc::client
