// SPDX-License-Identifier: Apache-2.0
// Checks that a host can observe the conditions of a virtual encoder.
#include <algorithm>
#include <array>
#include <set>

#include "tests/kit/changes.hpp"
#include "tests/kit/kit.hpp"

namespace absenc::kit {
namespace {

constexpr std::int64_t some_turns = 0x5'6000'0000;  // motion of the shaft: 5.375 turns, in units of 2^-32 turn

/// A virtual encoder with one condition set, and the host that reads it.
template <class Item>
class ConditionedEncoder {
 public:
  ConditionedEncoder(const Unit& unit, const Configuration& configuration, std::size_t condition, std::int64_t value)
      : world_(unit, configuration.options, 1) {
    if (!made()) return;
    world_.device().set_condition(condition, value, now());
    move();
  }

  [[nodiscard]] bool made() const { return world_.made(); }
  void move() { world_.move(world_.place() + some_turns); }
  // Switches the encoder off, turns the shaft, and switches the encoder on.
  void lose_power() {
    world_.device().power_off(now());
    move();
    world_.device().power_on(now(), Device<Item>::PowerOn::skip);
    world_.pass(std::chrono::milliseconds(1));
  }
  void raise(std::uint32_t alarms) { world_.device().raise_alarms(alarms); }
  [[nodiscard]] std::string ask(const Command& command) {
    const ConversationResult result = world_.run(command, least_arguments(command));
    return std::string(text_of(result.error).name) + " " + to_text(result.seen.fields);
  }

 private:
  [[nodiscard]] Time now() { return world_.line().now(); }

  World<Item> world_;
};

std::uint32_t all_alarms(const Unit& unit) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; unit.alarms != nullptr && i < unit.alarms->flags.size(); ++i) {
    if (!unit.alarms->flags[i].name.empty()) bits |= 1u << i;
  }
  return bits;
}

// Returns whether some command reports different results for two encoders of different condition whose shaft, power and
// memory a test has changed in the same way.
template <class Item>
bool reports_differ(const Unit& unit, ConditionedEncoder<Item>&& one, ConditionedEncoder<Item>&& other) {
  if (!one.made()) return false;
  const auto differs_after = [&](const Command& command) { return one.ask(command) != other.ask(command); };
  const auto any_differs = [&] {
    return std::any_of(unit.commands.begin(), unit.commands.end(), [&](const Command& command) {
      return !command.changes_encoder && command.verb != Verb::scan && differs_after(command);
    });
  };
  const auto both = [&](auto&& act) {
    act(one);
    act(other);
    return any_differs();
  };
  if (any_differs() || both([](auto& it) { it.lose_power(); })) return true;
  if (both([&](auto& it) { it.raise(all_alarms(unit)); })) return true;
  return std::any_of(unit.commands.begin(), unit.commands.end(), [&](const Command& command) {
    const bool resets =
        command.verb == Verb::clear_alarms || command.verb == Verb::reset_multiturn || command.verb == Verb::zero;
    return resets && (differs_after(command) || both([](auto& it) { it.move(); }));
  });
}

template <class Item>
bool is_seen(const Unit& unit, std::size_t index) {
  const Condition& condition = unit.conditions[index];
  const std::vector<Configuration> setups = configurations(unit);
  return std::any_of(setups.begin(), setups.end(), [&](const Configuration& configuration) {
    const auto differs = [&](std::int64_t value) {
      return value != condition.normal && reports_differ<Item>(unit, {unit, configuration, index, condition.normal},
                                                               {unit, configuration, index, value});
    };
    return differs(condition.minimum) || differs(condition.maximum);
  });
}

}  // namespace

Findings check_conditions(const Unit& unit) {
  Findings findings;
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < unit.conditions.size(); ++i) {
    const Condition& one = unit.conditions[i];
    const auto require = [&](bool holds, const char* text) {
      findings.require(holds, [&] { return "condition " + std::string(one.name) + " " + text; });
    };
    require(names.insert(one.name).second, "occurs twice");
    require(one.minimum < one.maximum && one.minimum <= one.normal && one.normal <= one.maximum,
            "has an invalid range");
    require(unit.link == LinkKind::can ? is_seen<CanFrame>(unit, i) : is_seen<std::uint8_t>(unit, i),
            "is invisible to every host");
  }
  return findings;
}

}  // namespace absenc::kit
