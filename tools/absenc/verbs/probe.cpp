// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/probe.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <vector>

#include "absenc/client/text/unit_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

std::string sentence(const OptionEvidence& evidence) {
  return evidence.possible ? std::string(evidence.why)
                           : fmt::format("frame {}: {}", evidence.capture + 1, evidence.why);
}

void show(const Unit& unit, std::span<const OptionEvidence> evidence) {
  std::vector<std::vector<std::string>> rows;
  std::size_t before = unit.options.size();
  for (const OptionEvidence& one : evidence) {
    const Option& option = unit.options[one.option];
    rows.push_back({std::string(one.option == before ? "" : option.name), to_text(option, one.value),
                    one.possible ? "possible" : "no", sentence(one)});
    before = one.option;
  }
  print_line(table(rows));
}

// Returns whether all values of an option are excluded by the same frame and for the same reason.
bool same_reason(std::span<const OptionEvidence> evidence) {
  return std::all_of(evidence.begin(), evidence.end(), [&](const OptionEvidence& one) {
    return !one.possible && one.capture == evidence.front().capture && one.why == evidence.front().why;
  });
}

int run_probe(const Invocation& invocation) {
  const Probed probed = probe(invocation.text("protocol"), invocation.text("--model"), invocation.texts("--option"),
                              invocation.texts("--hex"), invocation.texts("--request"));
  const auto& [unit, explained, evidence, settings] = probed;
  if (invocation.has("--json")) {
    print_line(to_json(probed).line());
  } else {
    if (explained || !same_reason(evidence)) show(*unit, evidence);
    if (explained && settings.empty()) print_line("\nthe defaults explain all frames; nothing else is excluded");
    if (!settings.empty()) print_line(fmt::format("\ngo on with: --option {}", fmt::join(settings, " --option ")));
    if (!explained) {
      print_message(same_reason(evidence)
                        ? fmt::format("whatever the options, {}", sentence(evidence.front()))
                        : "no options explain all frames: is one of them damaged, or of another encoder?");
    }
  }
  return explained ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 6> probe_parameters{{
    parameter::protocol,
    {"--hex", "FRAME", "a reply, as for `absenc decode`; \"\": none came", "", false, true},
    {"--request", "FRAME", "what it answers, one for each --hex in the same order; \"\": not known", "", false, true},
    parameter::model,
    parameter::protocol_option,
    parameter::json,
}};

constexpr std::array<Example, 2> probe_examples{{
    {"absenc probe esl --request 0857 --hex 084000efcdab341255277e086000abd57f67",
     "what one reply tells of the encoder that sent it"},
    {"absenc probe esl --hex 084000efcdab34125646b3086000abd6cd84 --json", "without the request, for a program"},
}};

}  // namespace

const Subcommand probe_subcommand{
    "probe",
    "find out from captured frames what the document of a protocol leaves open",
    "For each open option: which values remain possible, and which frame excludes the others. Then the options\n"
    "to go on with. Frames are given in the order of time; a sequence counter is only judged when none is left out.\n"
    "Exit status 1 when no options explain all frames.",
    probe_parameters,
    probe_examples,
    run_probe};

}  // namespace absenc::tool
