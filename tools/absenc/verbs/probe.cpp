// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <vector>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

struct Evidence final : EvidenceSink {
  void put(const OptionEvidence& evidence) override { all.push_back(evidence); }
  std::vector<OptionEvidence> all;
};

/// Frames from the command line, requests and replies by their order.
class Captures {
 public:
  Captures(const Unit& unit, std::span<const std::string> requests, std::span<const std::string> replies) {
    if (replies.empty()) throw UsageError("there is nothing to probe: give captured replies with --hex");
    if (!requests.empty() && requests.size() != replies.size()) {
      throw UsageError(
          fmt::format("{} --request for {} --hex: give one for each in the same order, or none; \"\" "
                      "where it is not known",
                      requests.size(), replies.size()));
    }
    for (std::size_t i = 0; i < replies.size(); ++i) {
      frames_.push_back(frame(unit, "--request", i < requests.size() ? requests[i] : ""));
      frames_.push_back(frame(unit, "--hex", replies[i]));
      if (frames_[2 * i].bytes.empty() && frames_[2 * i + 1].bytes.empty()) {
        throw UsageError(fmt::format("frame {} has neither request nor reply", i + 1));
      }
    }
    for (std::size_t i = 0; i < frames_.size(); i += 2) all.push_back({frames_[i].bytes, frames_[i + 1].bytes});
  }

  std::vector<Capture> all;

 private:
  static WireFrame frame(const Unit& unit, std::string_view what, std::string_view text) {
    return text.empty() ? WireFrame{} : parse_wire_text(unit.link, what, text);
  }

  std::vector<WireFrame> frames_;
};

// What must be said to go on: values that the frames have settled, and those that are not the default.
std::vector<std::string> settled(const Unit& unit, const Options& options, std::span<const OptionEvidence> evidence) {
  std::vector<std::string> settings;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    const auto possible = std::count_if(evidence.begin(), evidence.end(),
                                        [i](const OptionEvidence& one) { return one.option == i && one.possible; });
    if (possible == 0 || (possible > 1 && options[i] == option.default_value)) continue;
    settings.push_back(fmt::format("{}={}", option.name, to_text(option, options[i])));
  }
  return settings;
}

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

// Nothing that is open matters.
bool same_reason(std::span<const OptionEvidence> evidence) {
  return std::all_of(evidence.begin(), evidence.end(), [&](const OptionEvidence& one) {
    return !one.possible && one.capture == evidence.front().capture && one.why == evidence.front().why;
  });
}

Json evidence_json(const Unit& unit, std::span<const OptionEvidence> evidence) {
  return Json::list(evidence, [&](const OptionEvidence& one) {
    const Option& option = unit.options[one.option];
    Json json = Json::object().set("option", option.name).set("value", to_json(option, one.value));
    json.set("possible", one.possible).set("why", one.why);
    return one.possible ? json : json.set("frame", one.capture + 1);
  });
}

int run_probe(const Invocation& invocation) {
  const Unit& unit = require_unit(invocation.text("protocol"));
  if (unit.probe == nullptr) {
    throw UsageError(fmt::format("captured frames of {} leave nothing open: `absenc decode {}` says what they mean",
                                 unit.id, unit.id));
  }
  Options options = require_options(unit, invocation.text("--model"), invocation.texts("--option"));
  const Captures captures(unit, invocation.texts("--request"), invocation.texts("--hex"));
  Evidence evidence;
  const bool explained = unit.probe(options, captures.all, evidence);
  const std::vector<std::string> settings =
      explained ? settled(unit, options, evidence.all) : std::vector<std::string>();
  if (invocation.has("--json")) {
    Json json = Json::object().set("protocol", unit.id).set("ok", explained);
    print_line(json.set("evidence", evidence_json(unit, evidence.all)).set("settled", Json::list(settings)).line());
  } else {
    if (explained || !same_reason(evidence.all)) show(unit, evidence.all);
    if (explained && settings.empty()) print_line("\nthe defaults explain all frames; nothing else is excluded");
    if (!settings.empty()) print_line(fmt::format("\ngo on with: --option {}", fmt::join(settings, " --option ")));
    if (!explained) {
      print_message(same_reason(evidence.all)
                        ? fmt::format("whatever the options, {}", sentence(evidence.all.front()))
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
