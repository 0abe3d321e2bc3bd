// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/campaign.hpp"

#include <fmt/format.h>

#include <array>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/protocol/all.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"

namespace absenc::tool {

namespace {

std::string share_interval(const Share& share) { return fmt::format("{:.2g} to {:.2g}", share.low(), share.high()); }

Json share_json(const Share& share) {
  return Json::object().set("count", share.count).set("of", share.of).set("low", share.low()).set("high", share.high());
}

Json campaign_json(const CampaignResult& result) {
  Json json = Json::object().set("protocol", result.protocol).set("model", result.model);
  json.set("readings", result.readings).set("exchanges", result.exchanges).set("damaged", result.damaged);
  json.set("failed", share_json(result.failed)).set("given_up", share_json(result.given_up));
  json.set("recovered", share_json(result.recovered)).set("wrong", share_json(result.wrong));
  json.set("older", share_json(result.older)).set("changed", share_json(result.changed));
  if (!result.worth) return json.set("check", Json());
  const CheckWorth& worth = *result.worth;
  Json check = Json::object().set("bits", worth.check_bits).set("frame_bits", worth.frame_bits);
  check.set("distance", worth.distance).set("words", worth.words).set("unseen", worth.unseen);
  return json.set("check", check.set("taken", worth.taken).set("taken_deviation", worth.taken_deviation));
}

// "88 bits, 8 of them a check: errors of 1 bit are seen, 440 of 2 bits are not"
std::string worth_text(const CheckWorth& worth) {
  if (worth.check_bits == 0) return fmt::format("{} bits without a checksum", worth.frame_bits);
  const std::string size = fmt::format("{} bits with a checksum of {}", worth.frame_bits, worth.check_bits);
  if (worth.distance == 0) return size + ": no error of up to 8 bits passes";
  return fmt::format("{}: of the errors of {} bit{} {:.0f} pass, of fewer none", size, worth.distance,
                     worth.distance == 1 ? "" : "s", worth.words);
}

void print_campaign(const CampaignResult& result) {
  const auto line = [](std::string_view name, const Share& share, std::string_view of) {
    return std::vector<std::string>{std::string(name), fmt::format("{}", share.count),
                                    fmt::format("of {} {}", share.of, of), share_interval(share)};
  };
  const std::vector<std::vector<std::string>> rows{
      {"", "COUNT", "", "RATE, 95 %"},
      line("failed", result.failed, "exchanges"),
      line("wrong position taken", result.wrong, "exchanges"),
      line("of them older than the request", result.older, "exchanges"),
      line("encoder changed by a misheard request", result.changed, "exchanges"),
      line("recovered by another attempt", result.recovered, "readings"),
      line("given up", result.given_up, "readings"),
  };
  print_line(table(rows));
  if (result.worth) {
    print_line(fmt::format("check     {}", worth_text(*result.worth)));
    print_line(fmt::format("computed  {:.3g} of the replies would pass the checksum damaged, by independent bit errors",
                           result.worth->unseen));
    print_line(fmt::format("          {:.3g} +- {:.2g} all checks, with another position", result.worth->taken,
                           1.96 * result.worth->taken_deviation));
  } else {
    print_line("check     nothing is computed: not a linear one of at most 16 bits in the replies");
  }
  print_note(
      fmt::format("{:.3g} million exchanges a second", static_cast<double>(result.exchanges) / result.seconds / 1e6));
}

std::vector<std::string> campaign_row(const CampaignResult& result) {
  const auto& worth = result.worth;
  return {result.protocol,
          fmt::format("{:.2g} %", 100 * result.failed.rate()),
          fmt::format("{}", result.recovered.count),
          fmt::format("{}", result.given_up.count),
          fmt::format("{}", result.wrong.count),
          fmt::format("{}", result.older.count),
          fmt::format("{}", result.changed.count),
          share_interval(result.wrong),
          worth ? fmt::format("{}/{}", worth->check_bits, worth->frame_bits) : "-",
          worth ? (worth->distance == 0 ? ">8" : fmt::format("{}", worth->distance)) : "-",
          worth ? fmt::format("{:.2g}", worth->unseen) : "-",
          worth ? fmt::format("{:.2g}", worth->taken) : "-"};
}

CampaignChoices campaign_choices(const Invocation& invocation) {
  CampaignChoices choices{.model = std::string(invocation.text("--model"))};
  for (const std::string& text : invocation.texts("--option")) choices.options.push_back(text);
  for (const std::string& text : invocation.texts("--fault")) choices.faults.push_back(text);
  choices.exchanges = static_cast<std::uint64_t>(
      invocation.number("--exchanges", static_cast<std::int64_t>(choices.exchanges), 1, 1'000'000'000'000));
  choices.seed = static_cast<std::uint64_t>(invocation.number("--seed", 1, 0, INT64_MAX));
  return choices;
}

int run_campaign(const Invocation& invocation) {
  const CampaignChoices choices = campaign_choices(invocation);
  const bool json = invocation.has("--json");
  if (invocation.has("protocol")) {
    const CampaignResult result = campaign(invocation.text("protocol"), choices);
    if (json) {
      print_line(campaign_json(result).line());
    } else {
      print_campaign(result);
    }
    return exit_good;
  }
  if (!choices.model.empty() || !choices.options.empty()) throw UsageError("models and options belong to one protocol");
  std::vector<std::vector<std::string>> rows{{"PROTOCOL", "FAILED", "RECOVERED", "GIVEN UP", "WRONG", "OLDER",
                                              "CHANGED", "WRONG, 95 %", "CHECK", "DISTANCE", "PASS CHECKSUM",
                                              "PASS ALL"}};
  Progress progress;
  for (const Unit* unit : all_units()) {
    progress.show(unit->id);
    const CampaignResult result = campaign(unit->id, choices);
    progress.clear();
    if (json) print_line(campaign_json(result).line());
    rows.push_back(campaign_row(result));
  }
  if (!json) print_line(table(rows));
  return exit_good;
}

constexpr std::array<Parameter, 7> campaign_parameters{{
    {"protocol", "", "see `absenc list`", "each, a line for each"},
    parameter::model,
    parameter::protocol_option,
    {"--fault", "KIND=RATE",
     "how often, 0 to 1: each data bit of a reply (bit), each byte of a request (request_corrupt), or each reply "
     "(burst, "
     "double, talker, late, drop, corrupt, truncate, delay, echo, garbage, silence, repeat)",
     "a little of most", false, true},
    {"--exchanges", "N", "how many requests are sent", "100000"},
    {"--seed", "N", "of the faults: the same gives the same", "1"},
    parameter::json,
}};

constexpr std::array<Example, 3> campaign_examples{{
    {"absenc campaign tformat", "a little of everything that a line can do"},
    {"absenc campaign tformat --fault bit=0.01 --exchanges 1000000",
     "independent bit errors, beside what follows from the checksum"},
    {"absenc campaign --fault late=0.01", "late replies, to the encoders of every protocol"},
}};

}  // namespace

const Subcommand campaign_subcommand{
    "campaign",
    "count what a bad line makes of a protocol, in virtual time",
    "Host and virtual encoder over a line with random faults: how many exchanges fail, how many positions are taken\n"
    "that are not the encoder's, or are older than their request. Beside it, for the fault \"bit\", what follows from\n"
    "the checksum of the replies. No hardware is used.",
    campaign_parameters,
    campaign_examples,
    run_campaign};

}  // namespace absenc::tool
