// SPDX-License-Identifier: Apache-2.0
// Checks that a host never sets the zero from an invalid position.
#include "absenc/sim/place.hpp"
#include "tests/kit/kit.hpp"
#include "tests/kit/world.hpp"

namespace absenc::kit {
namespace {

constexpr std::int64_t some_place = 0x2'4567'89AB;

template <class Item>
std::optional<Reading> read_position(World<Item>& world, const Unit& unit) {
  const Command& read = *find_command(unit, Verb::read);
  return world.run(read, least_arguments(read)).seen.reading;
}

/// Checks that the zero command is refused after `spoil` has made the position invalid. `mend` makes it valid again.
template <class Item, class Spoil, class Mend>
void try_zero(const Unit& unit, const Configuration& configuration, const std::string& what, Spoil spoil, Mend mend,
              Findings& findings) {
  const Command& zero = *find_command(unit, Verb::zero);
  World<Item> world(unit, configuration.options, 1);
  if (!world.made()) return;
  world.move(some_place);
  spoil(world);
  const std::optional<Reading> before = read_position(world, unit);
  if (!before || before->singleturn_validity() != Validity::invalid) return;
  const std::uint32_t memory = world.device().memory_version();
  const ConversationResult result = world.run(zero, least_arguments(zero));
  if (!result.made || result.error == Error::unsupported) return;
  const auto says = [&](const char* text) {
    return [&, text] { return configuration.text + ", " + what + ": zero " + text; };
  };
  findings.require(!result.good(), says("is set from an invalid position"));
  findings.require(result.good() || result.error == Error::invalid_argument,
                   says("fails for another reason than the position"));
  findings.require(result.good() || !result.detail.empty(), says("is refused without a reason"));
  findings.require(world.device().memory_version() == memory, says("is written to the memory"));
  mend(world);
  const std::optional<Reading> after = read_position(world, unit);
  findings.require(!after || after->singleturn_validity() == Validity::invalid || sim::is_at(*after, world.place()),
                   says("has moved the position"));
}

template <class Item>
void try_all(const Unit& unit, const Configuration& configuration, Findings& findings) {
  const auto nothing = [](World<Item>&) {};
  try_zero<Item>(unit, configuration, "as it is", nothing, nothing, findings);
  for (std::size_t bit = 0; unit.alarms != nullptr && bit < unit.alarms->flags.size(); ++bit) {
    const std::string name(unit.alarms->flags[bit].name);
    if (name.empty()) continue;
    const std::uint32_t alarm = std::uint32_t{1} << bit;
    try_zero<Item>(
        unit, configuration, name, [&](World<Item>& world) { world.device().raise_alarms(alarm); },
        [&](World<Item>& world) { world.device().lower_alarms(alarm); }, findings);
  }
  for (std::size_t i = 0; i < unit.conditions.size(); ++i) {
    const Condition& one = unit.conditions[i];
    for (const std::int64_t value : {one.minimum, one.maximum}) {
      const auto set = [i](std::int64_t to) {
        return [i, to](World<Item>& world) { world.device().set_condition(i, to, world.line().now()); };
      };
      try_zero<Item>(unit, configuration, std::string(one.name) + "=" + std::to_string(value), set(value),
                     set(one.normal), findings);
    }
  }
}

}  // namespace

Findings check_zero(const Unit& unit) {
  Findings findings;
  if (find_command(unit, Verb::zero) == nullptr) return findings;
  for (const Configuration& configuration : configurations(unit)) {
    if (unit.link == LinkKind::can) {
      try_all<CanFrame>(unit, configuration, findings);
    } else {
      try_all<std::uint8_t>(unit, configuration, findings);
    }
  }
  return findings;
}

}  // namespace absenc::kit
