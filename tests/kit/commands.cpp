// SPDX-License-Identifier: Apache-2.0
// Runs the commands that change nothing with the virtual encoder on a line without faults, and checks their results.
#include <algorithm>

#include "absenc/sim/place.hpp"
#include "tests/kit/kit.hpp"
#include "tests/kit/world.hpp"

namespace absenc::kit {
namespace {

/// Returns whether the command is of a kind that must succeed with the options of each model, unless the encoder
/// refuses it.
bool is_plain(const Command& command) {
  return command.verb == Verb::read || command.verb == Verb::read_part || command.verb == Verb::info ||
         command.verb == Verb::temperature || command.verb == Verb::config_get;
}

// Returns whether `error` means that the encoder does not support the command or its arguments. Always returns false
// for `read`, which every encoder must support.
bool is_refused(const Command& command, Error error) {
  return command.verb != Verb::read && (error == Error::unsupported || error == Error::invalid_argument);
}

// Runs the unit's commands with one configuration. Options that no model has may make a command fail, but never make
// its result wrong.
template <class Item>
void run_commands(const Unit& unit, const Configuration& configuration, Findings& findings) {
  sim::Random random(7);
  for (const Command& command : unit.commands) {
    if (command.changes_encoder) continue;
    World<Item> world(unit, configuration.options, 1);
    if (!world.made()) return;
    const auto what = [&] { return configuration.text + ", " + std::string(command.name) + ": "; };
    for (unsigned i = 0; i < (command.verb == Verb::read ? 10 : 1); ++i) {
      world.move(static_cast<std::int64_t>(random.next()));
      const ConversationResult result = world.run(command, least_arguments(command));
      if (!result.made) break;
      findings.require(result.ended, [&] { return what() + "hangs"; });
      findings.require(!result.premature_reading,
                       [&] { return what() + "has a reading before any reply, or with an error"; });
      const bool may_fail = !configuration.is_model || !is_plain(command) || is_refused(command, result.error);
      findings.require(result.good() || may_fail,
                       [&] { return what() + std::string(text_of(result.error).name) + " " + result.detail; });
      if (!result.good()) break;
      findings.require(command.verb != Verb::scan || !result.seen.numbers(Role::encoder).empty(),
                       [&] { return what() + "does not report which encoder replied"; });
      if (result.seen.reading) {
        findings.require(sim::is_at(*result.seen.reading, world.place()),
                         [&] { return what() + "another position than the shaft's"; });
        const std::vector<std::int64_t> turns = result.seen.numbers(Role::turns);
        findings.require(turns.size() != 1 || turns[0] == result.seen.reading->turns(),
                         [&] { return what() + "shows other turns than its reading"; });
      } else {
        findings.require(command.verb != Verb::read, [&] { return what() + "has no reading"; });
      }
    }
    findings.require(world.device().violation_count() == 0 || !configuration.is_model, [&] {
      return what() + "the host broke a rule: " + std::string(world.device().violations()[0].rule);
    });
  }
}

}  // namespace

Findings check_commands(const Unit& unit) {
  Findings findings;
  for (const Configuration& configuration : configurations(unit)) {
    if (unit.link == LinkKind::can) {
      run_commands<CanFrame>(unit, configuration, findings);
    } else {
      run_commands<std::uint8_t>(unit, configuration, findings);
    }
  }
  return findings;
}

}  // namespace absenc::kit
