// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/identify.hpp"

#include "absenc/client/error.hpp"
#include "absenc/client/identify/capture.hpp"
#include "absenc/client/identify/line.hpp"

namespace absenc::client {

namespace {

FoundEncoder found(const Candidate& candidate, std::string_view place) {
  const capture::Hypothesis& one = candidate.hypothesis;
  return {.unit = candidate.unit,
          .options = one.options,
          .settings = settings_for(*candidate.unit, one.options),
          .address = place.empty() ? std::string() : address_of(candidate, place),
          .encoder = candidate.encoder,
          .line = candidate.line,
          .tried = one.evidence.tried,
          .explained = one.evidence.explained,
          .log10_chance = one.chance(),
          .sure = is_found(candidate),
          .identity = candidate.identity};
}

}  // namespace

Identified identify(std::string_view place, const IdentifyChoices& choices) {
  LineSearch search = parse_search(place);
  search.limit = choices.limit;
  search.progress = choices.progress ? choices.progress : [](const std::string&) {};
  const LineFindings findings = search_line(search);
  if (findings.interrupted) throw os::Interrupted{};
  Identified all{.notes = findings.notes, .is_complete = !findings.out_of_time};
  for (const Candidate& one : findings.candidates) all.found.push_back(found(one, search.place));
  return all;
}

Identified identify_capture(const std::string& path, const DecodeChoices& choices) {
  if (!choices.model.empty() || !choices.options.empty()) {
    throw UsageError("the model and the options are what is searched for: they cannot be given");
  }
  const CaptureFindings findings = search_capture({path, choices}, [](const std::string&) {});
  Identified all{.notes = findings.damages};
  all.notes.insert(all.notes.end(), findings.refusals.begin(), findings.refusals.end());
  for (const Candidate& one : findings.candidates) all.found.push_back(found(one, {}));
  return all;
}

}  // namespace absenc::client
