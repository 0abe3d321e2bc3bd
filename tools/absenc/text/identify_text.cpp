// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/identify_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "absenc/client/text/json.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

constexpr std::size_t most_shown = 8;

// Returns the probability 10^`log10` as text: "1 in 16384", "1 in 10^9", or "as likely" if it is nearly 1.
std::string chance_text(double log10) {
  if (log10 > -0.05) return "as likely";
  if (log10 > -6) return fmt::format("1 in {:.0f}", std::pow(10, -log10));
  return fmt::format("1 in 10^{:.0f}", std::floor(-log10));
}

std::string settings_text(const Candidate& candidate) {
  std::vector<std::string> settings = settings_for(*candidate.unit, candidate.hypothesis.options);
  if (candidate.unsolicited) settings.emplace_back("sends by itself");
  return settings.empty() ? "the defaults" : fmt::format("{}", fmt::join(settings, ", "));
}

Json to_json(const Candidate& candidate, const std::string& command) {
  const capture::Evidence& evidence = candidate.hypothesis.evidence;
  Json json = Json::object().set("protocol", candidate.unit->id);
  const Model* model = candidate.hypothesis.options.model;
  json.set("model", model != nullptr ? Json(model->name) : Json());
  json.set("options", options_to_json(*candidate.unit, candidate.hypothesis.options));
  json.set("encoder", candidate.encoder.empty() ? Json() : Json(candidate.encoder));
  json.set("identity", to_json(candidate.identity.row()));
  json.set("line", candidate.line).set("unasked", candidate.unsolicited);
  json.set("lookalikes", candidate.unit->lookalikes.empty() ? Json() : Json(candidate.unit->lookalikes));
  json.set("explained", evidence.explained).set("tried", evidence.tried).set("distinct", evidence.distinct);
  json.set("log10_chance", candidate.hypothesis.chance()).set("found", is_found(candidate));
  return json.set("more_bits_possible", candidate.hypothesis.at_least).set("command", command);
}

void show_table(std::span<const Candidate> candidates) {
  std::vector<std::vector<std::string>> rows{{"", "PROTOCOL", "WITH", "LINE", "EXPLAINED", "BY CHANCE"}};
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& one = candidates[i];
    const capture::Evidence& evidence = one.hypothesis.evidence;
    rows.push_back({fmt::format("{}", i + 1), std::string(one.unit->id), settings_text(one), one.line,
                    fmt::format("{} of {}", evidence.explained, evidence.tried), chance_text(one.hypothesis.chance())});
  }
  print_line(table(rows));
}

// Prints the identity of each candidate that has one, as "1 says: serial_number 12, device_id 41 62".
void show_identities(std::span<const Candidate> candidates) {
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Answer& identity = candidates[i].identity;
    std::vector<std::string> said;
    for (std::size_t column = 0; column < identity.columns.size(); ++column) {
      const Column& one = identity.columns[column];
      said.push_back(fmt::format("{} {}", one.name, to_text(one, identity.values[column])));
    }
    if (!said.empty()) print_line(fmt::format("{} says: {}", i + 1, fmt::join(said, ", ")));
  }
}

bool same_encoder(const Candidate& one, const Candidate& other) {
  return one.unit != other.unit || one.encoder == other.encoder || one.encoder.empty() || other.encoder.empty();
}

// Returns the likeliest candidate that counts as found, and the others of the same protocol that have other addresses.
std::vector<const Candidate*> encoders(std::span<const Candidate> candidates) {
  std::vector<const Candidate*> all;
  for (const Candidate& one : candidates) {
    const bool known =
        std::any_of(all.begin(), all.end(), [&](const Candidate* other) { return same_encoder(one, *other); });
    if (is_found(one) && !known) all.push_back(&one);
  }
  return all;
}

// Returns a note for each encoder that was found, if several candidates explain its frames equally well.
std::vector<std::string> ties(std::span<const Candidate> candidates, std::span<const Candidate* const> found) {
  std::vector<std::string> notes;
  for (const Candidate* best : found) {
    const auto equal = std::count_if(candidates.begin(), candidates.end(), [&](const Candidate& one) {
      return same_encoder(one, *best) && is_as_likely(one, *best);
    });
    if (equal < 2) continue;
    const std::string who = found.size() > 1 ? fmt::format(" from {}", best->encoder) : std::string();
    notes.push_back(
        fmt::format("note: {} of them explain what came{} equally well: compare their positions while the shaft turns",
                    equal, who));
  }
  return notes;
}

std::vector<std::string> advice(std::span<const Candidate> candidates) {
  const Candidate& best = candidates.front();
  if (!is_found(best)) {
    return {
        "this may be chance: nothing speaks for it that noise could not do as well\n"
        "  Try: turn the shaft a little while it is asked, so that the frames differ; capture more frames"};
  }
  const std::vector<const Candidate*> found = encoders(candidates);
  std::vector<std::string> notes = ties(candidates, found);
  if (found.size() > 1) {
    std::vector<std::string> names;
    for (const Candidate* one : found) names.push_back(one->encoder);
    notes.push_back(fmt::format("note: {} encoders are on the line: {}", found.size(), fmt::join(names, ", ")));
  }
  if (!best.unit->lookalikes.empty()) {
    notes.push_back(
        fmt::format("note: {} answers like this: to know that it is {}, compare the position while the shaft turns",
                    best.unit->lookalikes, best.unit->name));
  }
  if (notes.empty() && best.hypothesis.at_least) {
    return {"note: the position may have more bits: these are the fewest that hold all that came; turn the shaft once"};
  }
  return notes;
}

}  // namespace

std::string advice_for(const LineFindings& findings, const LineSearch& search) {
  if (findings.heard == 0 && findings.unsolicited == 0 && findings.only_echo) {
    return "only what was sent came back (the adapter's echo), and nothing from an encoder\n"
           "  Try: the encoder's supply and ground; A and B swapped; the wires between adapter and encoder";
  }
  if (findings.heard == 0 && findings.unsolicited == 0) {
    return fmt::format(
        "{} requests were sent, and nothing came back\n"
        "  Try: the encoder's supply and ground; A and B (or TX and RX) swapped; termination; an adapter that can\n"
        "  send at these rates; more time, as in {}?latency=50",
        findings.requests, search.place);
  }
  return fmt::format(
      "{} bytes came, but no protocol explains them\n"
      "  Try: A and B swapped, which makes every byte wrong; the baud rate, as in {}?baud=9600; shielding and\n"
      "  termination; it may be an encoder that absenc does not know: `absenc crc find` looks into its frames",
      findings.heard + findings.unsolicited, search.place);
}

std::string read_command(const Candidate& candidate, std::string_view place) {
  return fmt::format("absenc read {}", shell_text(address_of(candidate, place)));
}

std::string decode_command(const Candidate& candidate) {
  std::string text = fmt::format("absenc decode {}", candidate.unit->id);
  for (const std::string& setting : settings_for(*candidate.unit, candidate.hypothesis.options)) {
    const bool quoted = setting.find(' ') != std::string::npos;
    text += quoted ? fmt::format(" --option \"{}\"", setting) : fmt::format(" --option {}", setting);
  }
  return text;
}

int show_candidates(std::span<const Candidate> candidates, const SearchNotes& search,
                    const std::function<std::string(const Candidate&)>& command, bool json) {
  const bool found = !candidates.empty() && is_found(candidates.front());
  if (json) {
    const Json list = Json::list(candidates, [&](const Candidate& one) { return to_json(one, command(one)); });
    Json result = Json::object().set("ok", found).set("candidates", list);
    print_line(result.set("notes", Json::list(search.notes)).set("complete", search.is_complete).line());
    return found ? exit_good : exit_failed;
  }
  if (candidates.empty()) return exit_failed;
  const auto shown = candidates.first(std::min(candidates.size(), most_shown));
  show_table(shown);
  show_identities(shown);
  const std::vector<std::string> notes = advice(candidates);
  std::string next = "\ngo on with: ";
  for (const Candidate* one : encoders(candidates)) {
    print_line(std::exchange(next, "       and: ") + command(*one));
  }
  if (!found) print_line("\nif it is the first: " + command(candidates.front()));
  for (const std::string& note : notes) print_message(note);
  return found ? exit_good : exit_failed;
}

}  // namespace absenc::tool
