// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/way/connection.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/reading_text.hpp"
#include "tools/absenc/verbs/run.hpp"

namespace absenc::tool {

namespace {

struct ShownAlarms {
  Flags flags;
  bool told_when_none;
};

// Alarms first. Of encoders without alarms the status says that there is nothing.
std::vector<ShownAlarms> flags_of(const Unit& unit, const Reading& reading) {
  std::vector<ShownAlarms> all;
  for (const Flags& flags : alarms_of(unit, reading)) all.push_back({flags, true});
  for (const Flags& flags : status_of(unit, reading)) all.push_back({flags, unit.alarms == nullptr});
  return all;
}

void show_alarms(const Unit& unit, const Reading& reading) {
  for (const auto& [flags, told_when_none] : flags_of(unit, reading)) {
    const std::string words = flags_in_words(flags);
    if (!words.empty()) print_line(fmt::format("{}:\n{}", flags.field->name, words));
    if (words.empty() && told_when_none) print_line(fmt::format("no {}", flags.field->name));
  }
}

void show_json(const Unit& unit, const Reading& reading) {
  Json json = Json::object().set("ok", true).set("protocol", unit.id);
  for (const auto& [flags, told] : flags_of(unit, reading)) {
    json.set(flags.field->name, Json::list(raised(*flags.field, flags.bits), flag_to_json));
  }
  print_line(json.line());
}

int run_alarms(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  if (uri.unit->alarms == nullptr && uri.unit->status == nullptr) {
    throw UsageError(fmt::format("the encoders of {} have no alarms", uri.unit->id));
  }
  const std::unique_ptr<Connection> encoder = open_connection(uri);
  const Outcome outcome = encoder->read();
  if (outcome.error != Error::none) throw EncoderFailure(encoder->trouble(outcome));
  if (outcome.reading == nullptr) throw Failure("the encoder's reply carries no alarms");
  if (invocation.has("--json")) {
    show_json(*uri.unit, *outcome.reading);
  } else {
    show_alarms(*uri.unit, *outcome.reading);
  }
  return exit_good;
}

constexpr std::array<Parameter, 3> alarms_parameters{{
    parameter::encoder,
    {"--json", "", "one JSON object: of each alarm its name, meaning and action"},
    parameter::option,
}};

constexpr std::array<Example, 2> alarms_examples{{
    {"absenc alarms tformat:/dev/ttyUSB0", "what is wrong with the encoder, and what to do"},
    {"absenc alarms \"sim:tformat?alarm=over_heat&alarm=battery_alarm\"", "try it without hardware"},
}};

}  // namespace

const Subcommand alarms_subcommand{
    "alarms",
    "say in words which alarms the encoder has and what to do",
    "Alarms and status flags of one reading. `absenc list <protocol>` shows all that there are.\n"
    "Exit status 0 when the encoder could be read, with alarms or without; scripts look at --json.",
    alarms_parameters,
    alarms_examples,
    run_alarms};

}  // namespace absenc::tool
