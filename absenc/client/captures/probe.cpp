// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/probe.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/client/error.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"

namespace absenc::client {

namespace {

struct EvidenceList final : EvidenceSink {
  void put(const OptionEvidence& evidence) override { all.push_back(evidence); }
  std::vector<OptionEvidence> all;
};

/// Frames from the command line: the first request belongs to the first reply, and so on.
class Captures {
 public:
  Captures(const Unit& unit, std::span<const std::string> requests, std::span<const std::string> replies) {
    if (replies.empty()) throw UsageError("there is nothing to probe: give captured replies (--hex)");
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

// Returns, as settings, the values of those probed options that later commands (`decode`, `read`) must be given:
// options with a single possible value, and open ones whose value is not the default.
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

}  // namespace

Probed probe(std::string_view protocol, std::string_view model, std::span<const std::string> settings,
             std::span<const std::string> replies, std::span<const std::string> requests) {
  const Unit& unit = require_unit(protocol);
  if (unit.probe == nullptr) {
    throw UsageError(fmt::format("captured frames of {} leave nothing open: `absenc decode {}` says what they mean",
                                 unit.id, unit.id));
  }
  Options options = require_options(unit, model, settings);
  const Captures captures(unit, requests, replies);
  EvidenceList evidence;
  Probed probed{.unit = &unit, .explained = unit.probe(options, captures.all, evidence)};
  probed.evidence = std::move(evidence.all);
  if (probed.explained) probed.settled = settled(unit, options, probed.evidence);
  return probed;
}

Json to_json(const Probed& probed) {
  const Json evidence = Json::list(probed.evidence, [&](const OptionEvidence& one) {
    const Option& option = probed.unit->options[one.option];
    Json json = Json::object().set("option", option.name).set("value", to_json(option, one.value));
    json.set("possible", one.possible).set("why", one.why);
    return one.possible ? json : json.set("frame", one.capture + 1);
  });
  return Json::object()
      .set("protocol", probed.unit->id)
      .set("ok", probed.explained)
      .set("evidence", evidence)
      .set("settled", Json::list(probed.settled));
}

}  // namespace absenc::client
