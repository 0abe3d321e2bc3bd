// SPDX-License-Identifier: Apache-2.0
// Verbs such as `zero`, which run the protocol's command for that purpose, whatever its name.
#include <fmt/format.h>

#include <array>

#include "absenc/client/text/unit_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/verbs/run.hpp"

namespace absenc::tool {

namespace {

// Returns a sentence that lists the commands for `absenc run` whose names contain `word`; "" if there is none.
std::string related(const Unit& unit, std::string_view word) {
  std::string names;
  for (const Command& command : unit.commands) {
    if (command.verb != Verb::run || command.name.find(word) == std::string_view::npos) continue;
    names += fmt::format("{}`absenc run {}:PORT {}` ({})", names.empty() ? ". There is " : ", ", unit.id, command.name,
                         command.meaning);
  }
  return names;
}

template <Verb verb>
int run_verb(const Invocation& invocation) {
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  const Command* command = find_command(*uri.unit, verb);
  if (command == nullptr) {
    throw UsageError(fmt::format("{} has no command for this: `absenc list {}` shows those it has{}", uri.unit->id,
                                 uri.unit->id, verb == Verb::zero ? related(*uri.unit, "zero") : ""));
  }
  return run_command(invocation, uri, *command, require_arguments(*command, {}));
}

constexpr std::array<Parameter, 3> reading_parameters{{parameter::encoder, parameter::json, parameter::option}};
constexpr std::array<Parameter, 4> changing_parameters{
    {parameter::encoder, parameter::yes, parameter::json, parameter::option}};

constexpr std::string_view asks_first =
    "Asks first; without a terminal it needs --yes. The shaft must stand still. What became of it is read back.";

constexpr std::array<Example, 2> temperature_examples{{
    {"absenc temperature tformat:/dev/ttyUSB0", "how warm the encoder is"},
    {"absenc temperature sim:tformat --json", "the same of a virtual encoder, for programs"},
}};
constexpr std::array<Example, 2> zero_examples{{
    {"absenc zero tformat:/dev/ttyUSB0", "from now on the position is counted from here"},
    {"absenc zero sim:tformat", "try it without hardware"},
}};
constexpr std::array<Example, 2> reset_multiturn_examples{{
    {"absenc reset-multiturn tformat:/dev/ttyUSB0", "after the battery was replaced and the origin found"},
    {"absenc reset-multiturn tformat:/dev/ttyUSB0 --yes", "without being asked, for scripts"},
}};
constexpr std::array<Example, 2> clear_alarms_examples{{
    {"absenc clear-alarms tformat:/dev/ttyUSB0", "after their cause was mended"},
    {"absenc clear-alarms \"sim:tformat?alarm=counter_overflow\"", "try it without hardware"},
}};

}  // namespace

const Subcommand temperature_subcommand{"temperature",
                                        "read the temperature of the encoder",
                                        "",
                                        reading_parameters,
                                        temperature_examples,
                                        run_verb<Verb::temperature>};
const Subcommand zero_subcommand{"zero",        "make this position the zero of the turn",
                                 asks_first,    changing_parameters,
                                 zero_examples, run_verb<Verb::zero>};
const Subcommand reset_multiturn_subcommand{
    "reset-multiturn",   "set the turns to zero",  asks_first,
    changing_parameters, reset_multiturn_examples, run_verb<Verb::reset_multiturn>};
const Subcommand clear_alarms_subcommand{
    "clear-alarms",        "clear the alarms that are latched", asks_first, changing_parameters,
    clear_alarms_examples, run_verb<Verb::clear_alarms>};

}  // namespace absenc::tool
