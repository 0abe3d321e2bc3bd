// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
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

Json guarded_json(const Guarded& guarded) {
  Json json = Json::object().set("confirmed", share_json(guarded.confirmed)).set("wrong", share_json(guarded.wrong));
  return json.set("alone", share_json(guarded.alone)).set("let_through", guarded.let_through);
}

Json campaign_json(const CampaignResult& result) {
  Json json = Json::object().set("protocol", result.protocol).set("model", result.model);
  json.set("readings", result.readings).set("exchanges", result.exchanges).set("damaged", result.damaged);
  json.set("failed", share_json(result.failed)).set("given_up", share_json(result.given_up));
  json.set("recovered", share_json(result.recovered)).set("wrong", share_json(result.wrong));
  json.set("older", share_json(result.older)).set("changed", share_json(result.changed));
  if (result.guarded) return json.set("guarded", guarded_json(*result.guarded));
  if (!result.worth) return json.set("check", Json());
  const CheckWorth& worth = *result.worth;
  Json check = Json::object().set("bits", worth.check_bits).set("frame_bits", worth.frame_bits);
  check.set("distance", worth.distance).set("words", worth.words).set("unseen", worth.unseen);
  return json.set("check", check.set("taken", worth.taken).set("taken_deviation", worth.taken_deviation));
}

// Returns which undetected errors a checksum permits: "88 bits with a checksum of 8: of the errors of 2 bits 440 pass,
// of fewer none".
std::string worth_text(const CheckWorth& worth) {
  if (worth.check_bits == 0) return fmt::format("{} bits without a checksum", worth.frame_bits);
  const std::string size = fmt::format("{} bits with a checksum of {}", worth.frame_bits, worth.check_bits);
  if (worth.distance == 0) return size + ": no error of up to 8 bits passes";
  return fmt::format("{}: of the errors of {} bit{} {:.0f} pass, of fewer none", size, worth.distance,
                     worth.distance == 1 ? "" : "s", worth.words);
}

using Rows = std::vector<std::vector<std::string>>;

std::vector<std::string> share_row(std::string_view name, const Share& share, std::string_view of) {
  return {std::string(name), fmt::format("{}", share.count), fmt::format("of {} {}", share.of, of),
          share_interval(share)};
}

void print_guarded(const CampaignResult& result) {
  const Guarded& guarded = *result.guarded;
  print_line(table(Rows{
      {"", "COUNT", "", "RATE, 95 %"},
      share_row("failed", result.failed, "exchanges"),
      share_row("wrong with good checks", guarded.alone, "positions"),
      share_row("given up", result.given_up, "readings"),
      share_row("confirmed", guarded.confirmed, "readings"),
      share_row("wrong and confirmed", guarded.wrong, "confirmed"),
  }));
  print_line(fmt::format("computed  {:.3g} wrong ones agree by chance with the position before", guarded.let_through));
}

void print_campaign(const CampaignResult& result) {
  if (result.guarded) return print_guarded(result);
  const auto line = share_row;
  const Rows rows{
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

std::string share_text(double rate) { return rate == 0 ? "0" : fmt::format("{:.2g}", rate); }

std::vector<std::string> guarded_row(const CampaignResult& result) {
  const Guarded& guarded = *result.guarded;
  const auto confirmed = static_cast<double>(std::max<std::uint64_t>(1, guarded.confirmed.count));
  return {result.protocol,
          fmt::format("{:.2g} %", 100 * result.failed.rate()),
          fmt::format("{:.4g} %", 100 * guarded.confirmed.rate()),
          share_text(guarded.alone.rate()),
          fmt::format("{}", guarded.wrong.count),
          share_text(guarded.wrong.rate()),
          share_interval(guarded.wrong),
          share_text(guarded.let_through / confirmed)};
}

const std::vector<std::string> campaign_heading{"PROTOCOL", "FAILED",   "RECOVERED",     "GIVEN UP",
                                                "WRONG",    "OLDER",    "CHANGED",       "WRONG, 95 %",
                                                "CHECK",    "DISTANCE", "PASS CHECKSUM", "PASS ALL"};
const std::vector<std::string> guarded_heading{"PROTOCOL", "FAILED", "CONFIRMED",  "WRONG ALONE",
                                               "WRONG",    "RATE",   "RATE, 95 %", "LET THROUGH"};

CampaignChoices campaign_choices(const Invocation& invocation) {
  CampaignChoices choices{.model = std::string(invocation.text("--model"))};
  for (const std::string& text : invocation.texts("--option")) choices.options.push_back(text);
  for (const std::string& text : invocation.texts("--fault")) choices.faults.push_back(text);
  choices.exchanges = static_cast<std::uint64_t>(
      invocation.number("--exchanges", static_cast<std::int64_t>(choices.exchanges), 1, 1'000'000'000'000));
  choices.seed = static_cast<std::uint64_t>(invocation.number("--seed", 1, 0, INT64_MAX));
  if (invocation.has("--rpm")) choices.rpm = invocation.real("--rpm", 0, -100'000, 100'000);
  if (invocation.has("--max-rpm")) {
    if (!choices.rpm) throw UsageError("--max-rpm is for a shaft that turns: set --rpm as well");
    choices.maximum_rpm = static_cast<std::uint32_t>(invocation.number("--max-rpm", 1, 1, 1'000'000));
  }
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
  Rows rows{choices.rpm ? guarded_heading : campaign_heading};
  Progress progress;
  for (const Unit* unit : all_units()) {
    progress.show(unit->id);
    const CampaignResult result = campaign(unit->id, choices);
    progress.clear();
    if (json) print_line(campaign_json(result).line());
    rows.push_back(choices.rpm ? guarded_row(result) : campaign_row(result));
  }
  if (!json) print_line(table(rows));
  return exit_good;
}

constexpr std::array<Parameter, 9> campaign_parameters{{
    {"protocol", "", "see `absenc list`", "each, a line for each"},
    parameter::model,
    parameter::protocol_option,
    {"--fault", "KIND=RATE",
     "how often, 0 to 1: each data bit of a reply (bit), each byte of a request (request_corrupt), or each reply "
     "(burst, "
     "double, talker, late, drop, corrupt, truncate, delay, echo, garbage, silence, repeat)",
     "a little of most", false, true},
    {"--rpm", "R",
     "how fast the shaft turns (linear encoders: R mm/s); positions are confirmed then, as `absenc read` does it, and "
     "those that are wrong are counted",
     "it is put somewhere else before every reading, and no position is confirmed"},
    {"--max-rpm", "N", "the speed limit that the host is told (linear encoders: N mm/s)",
     "that of the model, or 10000 rpm, or 20000 mm/s"},
    {"--exchanges", "N", "how many requests are sent", "100000"},
    {"--seed", "N", "of the faults: the same gives the same", "1"},
    parameter::json,
}};

constexpr std::array<Example, 4> campaign_examples{{
    {"absenc campaign tformat", "a little of everything that a line can do"},
    {"absenc campaign tformat --fault bit=0.01 --exchanges 1000000",
     "independent bit errors, beside what follows from the checksum"},
    {"absenc campaign ssi --fault corrupt=0.1 --rpm 60 --max-rpm 100",
     "wrong positions that the speed limit lets through, beside what follows from it"},
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
