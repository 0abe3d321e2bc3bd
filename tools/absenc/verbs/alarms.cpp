// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <vector>

#include "absenc/client/encoder/connection.hpp"
#include "absenc/client/row.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
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

bool reports_any(const std::vector<Flags>& all) {
  return std::any_of(all.begin(), all.end(),
                     [](const Flags& flags) { return !flag_names(*flags.field, flags.reported).empty(); });
}

bool reports_all(const std::vector<Flags>& all) {
  return std::all_of(all.begin(), all.end(), [](const Flags& flags) { return flags.is_complete(); });
}

void show_alarms(const Unit& unit, const Reading& reading) {
  const auto show = [&](const Flags& flags, bool also_clear) {
    const std::string words = flags_in_words(flags, true);
    if (!words.empty()) print_line(fmt::format("{}:\n{}", flags.field->name, words));
    if (!also_clear) return;
    if (!flags.is_complete()) {
      const std::vector<std::string_view> clear = flag_names(*flags.field, flags.reported & ~flags.bits);
      if (!clear.empty()) print_line(fmt::format("{} clear: {}", flags.field->name, fmt::join(clear, " ")));
      print_line(flags_text(unit, {flags.field, 0, flags.reported}));
    } else if (words.empty()) {
      print_line(flags_text(unit, flags));
    }
  };
  const std::vector<Flags> alarms = alarms_of(unit, reading);
  for (const Flags& flags : alarms) show(flags, true);
  for (const Flags& flags : status_of(unit, reading)) show(flags, alarms.empty() || !reports_all(alarms));
}

void show_json(const Unit& unit, const Reading& reading) {
  Json json = Json::object().set("ok", true).set("protocol", unit.id);
  const auto shown = [](const FlagInfo* flag) { return flag_to_json(flag).set("action", action_of(*flag, true)); };
  for (const std::vector<Flags>& all : {alarms_of(unit, reading), status_of(unit, reading)}) {
    for (const Flags& flags : all) {
      const bool is_known = has_value(value_of(flags));
      json.set(flags.field->name, is_known ? Json::list(raised(*flags.field, flags.bits), shown) : Json());
    }
  }
  print_line(json.line());
}

[[noreturn]] void refuse(const Unit& unit, const Reading& reading) {
  const std::string names = unit.alarms != nullptr ? fmt::format("{}", fmt::join(flag_names(*unit.alarms, ~0ull), ", "))
                                                   : std::string(unit.status->name);
  const std::string advice =
      takes_word(unit)
          ? fmt::format("if its word has bits for them, say where: {}=... or the options of `absenc list {}`",
                        word_option_name, unit.id)
          : fmt::format("`absenc list {}` shows its options and commands", unit.id);
  std::string place = place_text(reading);
  place.erase(0, place.find_first_not_of(' '));
  throw Failure(
      fmt::format("the alarms are not known: a reply of {} with these options reports none of {}\n"
                  "  it reported only {}\n  Try: {}",
                  unit.id, names, place, advice));
}

int run_alarms(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  if (uri.unit->alarms == nullptr && uri.unit->status == nullptr) {
    throw UsageError(fmt::format("the encoders of {} have no alarms", uri.unit->id));
  }
  const std::unique_ptr<Connection> encoder = open_connection(uri);
  const Reading reading = client::read_alarms(*encoder);
  if (!reports_any(flags_of(*uri.unit, reading))) refuse(*uri.unit, reading);
  if (invocation.has("--json")) {
    show_json(*uri.unit, reading);
  } else {
    show_alarms(*uri.unit, reading);
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
    "Exit status 0 when the encoder has reported alarms or that there are none; scripts look at --json, where [] "
    "means\n"
    "that all are clear and null that nobody has reported them. Exit status 1 when nothing could be found out.",
    alarms_parameters,
    alarms_examples,
    run_alarms};

}  // namespace absenc::tool
