// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/identify_capture.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/client/captures/words.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/identify.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

namespace {

using capture::Hypothesis;
using capture::ObservedExchange;

// number of replies, good or bad, at which decoding stops: they suffice to decide whether the capture has this protocol
constexpr std::size_t enough = 300;
// number of bytes outside of frames at which decoding stops: they suffice to decide whether the capture has this
// protocol
constexpr std::size_t enough_noise = 3000;

/// Thrown to stop decoding when enough of the capture was read.
struct Enough {};

capture::ObservedFrame owned(const Frame& frame) {
  capture::ObservedFrame heard{.bytes = {frame.bytes.begin(), frame.bytes.end()}, .bits = frame.bits};
  if (frame.can != nullptr) heard.can = *frame.can;
  return heard;
}

/// Collects replies with their requests. A byte of noise is stored as an exchange, too, because each could have begun a
/// frame.
struct Collector final : capture::AnnotationSink {
  void put(const capture::Annotation& annotation) override {
    using Kind = capture::Annotation::Kind;
    if (os::interrupted()) throw os::Interrupted{};
    // Skips cut frames, and frames that are composed of several exchanges, which are already counted.
    if (annotation.remark == capture::Remark::cut || annotation.composed) return;
    if (annotation.kind == Kind::noise) {
      for (const std::uint8_t byte : annotation.reply.bytes) exchanges.push_back({.reply = {.bytes = {byte}}});
      noise += annotation.reply.bytes.size();
    } else if (!annotation.reply.empty()) {
      exchanges.push_back({owned(annotation.request), owned(annotation.reply)});
      ++replies;
    }
    if (replies >= enough || noise >= enough_noise) throw Enough{};
  }
  std::vector<ObservedExchange> exchanges;
  std::size_t replies = 0;
  std::size_t noise = 0;
};

using Sentences = std::vector<std::string>;

std::vector<ObservedExchange> heard_as(const Unit& unit, const Options& options, const CaptureChoices& choices,
                                       Sentences& damages) {
  CaptureRun run(unit, options, choices);
  Collector collector;
  try {
    const CaptureOutcome outcome = run.run(collector, [](capture::Tick) {});
    for (const capture::Damage& damage : outcome.damages) {
      if (!damage.note) damages.push_back(to_text(damage, TickClock(run.ticks_per_second())));
    }
  } catch (const Enough&) {
  }
  // If no frame was found, the collected bytes are no evidence: with some options each single byte would count as a
  // frame.
  if (collector.replies == 0) return {};
  return std::move(collector.exchanges);
}

// Returns the sets of options with which the capture is decoded: each model, and each choice that the document leaves
// open. With wrong options a frame may not be recognised.
std::vector<Options> bases(const Unit& unit) {
  std::vector<Options> all = capture::likely_options(unit, {});
  if (all.empty()) return all;
  const Options usual = all.front();
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const auto count = static_cast<std::int64_t>(unit.options[i].probeable ? unit.options[i].choices.size() : 0);
    for (std::int64_t value = 0; value < count; ++value) {
      if (value == usual[i]) continue;
      all.push_back(usual);
      all.back().values[i] = value;
      all.back().model = nullptr;
    }
  }
  return all;
}

// Searches for options with which the unit explains the capture. Decodes the capture with the options of `bases`, and
// again with the options that this search has found, because the division into frames depends on the options.
std::vector<Hypothesis> search_unit(const Unit& unit, const CaptureChoices& choices, std::size_t& searches,
                                    Sentences& damages) {
  std::vector<Hypothesis> best;
  const auto better = [&](std::vector<Hypothesis>& found) {
    return !found.empty() && (best.empty() || found.front().chance() < best.front().chance());
  };
  for (const Options& options : bases(unit)) {
    if (options.model == nullptr && !best.empty() && best.front().chance() <= capture::is_found) break;
    ++searches;
    std::vector<Hypothesis> found = capture::find_hypotheses(unit, {}, heard_as(unit, options, choices, damages));
    if (!better(found)) continue;
    const Hypothesis first = found.front();
    best = std::move(found);
    if (first.options.values == options.values) continue;
    ++searches;
    std::vector<Hypothesis> again = capture::find_hypotheses(unit, {}, heard_as(unit, first.options, choices, damages));
    if (better(again)) best = std::move(again);
  }
  return best;
}

}  // namespace

CaptureFindings search_capture(const CaptureChoices& choices, const std::function<void(const std::string&)>& progress) {
  CaptureFindings findings;
  std::size_t searches = 0;
  for (const Unit* unit : all_units()) {
    progress(fmt::format("{}: {} found so far", unit->id, findings.candidates.size()));
    try {
      for (Hypothesis& one : search_unit(*unit, choices, searches, findings.damages)) {
        findings.candidates.push_back({unit, std::move(one), {}, false, line_of(*unit)});
      }
    } catch (const UsageError& error) {  // the decoder throws this if the protocol needs another kind of capture
      findings.refusals.emplace_back(error.what());
    } catch (const Failure& failure) {
      findings.refusals.emplace_back(failure.what());
    }
  }
  for (Sentences* sentences : {&findings.damages, &findings.refusals}) {
    std::sort(sentences->begin(), sentences->end());
    sentences->erase(std::unique(sentences->begin(), sentences->end()), sentences->end());
  }
  std::erase_if(findings.refusals, [&](const std::string& refusal) {
    return std::binary_search(findings.damages.begin(), findings.damages.end(), refusal);
  });
  rank(findings.candidates, searches);
  return findings;
}

Identified identify_capture(const std::string& path, const DecodeChoices& choices) {
  if (!choices.model.empty() || !choices.options.empty()) {
    throw UsageError("the model and the options are what is searched for: they cannot be given");
  }
  const CaptureFindings findings = search_capture({path, choices}, [](const std::string&) {});
  Identified all{.notes = findings.damages};
  all.notes.insert(all.notes.end(), findings.refusals.begin(), findings.refusals.end());
  for (const Candidate& one : findings.candidates) all.found.push_back(found_encoder(one, {}));
  return all;
}

}  // namespace absenc::client
