// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/identify.hpp"

#include "absenc/client/identify/line.hpp"

namespace absenc::client {

FoundEncoder found_encoder(const Candidate& candidate, std::string_view place) {
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

Identified identify(std::string_view place, const IdentifyChoices& choices) {
  LineSearch search = parse_search(place);
  search.limit = choices.limit;
  search.progress = choices.progress ? choices.progress : [](const std::string&) {};
  const LineFindings findings = search_line(search);
  if (findings.interrupted) throw os::Interrupted{};
  Identified all{.notes = findings.notes, .is_complete = !findings.out_of_time};
  for (const Candidate& one : findings.candidates) all.found.push_back(found_encoder(one, search.place));
  return all;
}

}  // namespace absenc::client
