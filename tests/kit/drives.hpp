// SPDX-License-Identifier: Apache-2.0
// Configurations in which a drive can read a position in every cycle.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "absenc/host/cyclic_host.hpp"
#include "tests/kit/world.hpp"

namespace absenc::kit {

/// Position at which the shaft stands: 4660 turns and about a third, in 2^-32 revolution.
inline constexpr std::int64_t standing_place = 0x1234'5678'9ABC;

/// Returns the longest time that `read` takes; no value if the unit has no virtual encoder for this configuration, or
/// if `read` sends several requests, as a drive's reading must not.
template <class Item>
[[nodiscard]] std::optional<Time> time_of_position(const Unit& unit, const Configuration& configuration,
                                                   const Command& read) {
  World<Item> world(unit, configuration.options, 1);
  if (!world.made()) return std::nullopt;
  world.move(standing_place);
  world.run(read, {});
  const Time begin = world.line().now();
  const ConversationResult result = world.run(read, {});
  if (!result.good() || (result.request_count > 1 && !result.sent.empty())) return std::nullopt;
  const Time without_alarm = world.line().now() - begin;
  // While an alarm is raised, `read` may send an additional request.
  world.device().raise_alarms(~std::uint32_t{0});
  const Time again = world.line().now();
  world.run(read, {});
  return std::max(without_alarm, world.line().now() - again);
}

/// Returns the facts about the line of this configuration for a CyclicHost, without a period.
[[nodiscard]] inline host::CyclePlan plan_for(const Unit& unit, const Configuration& configuration) {
  return {.line = line_settings(unit, configuration.options).with_some_rate(),
          .rest = unit.rest != nullptr ? unit.rest(configuration.options) : Time{},
          .carried = unit.services_carry_position};
}

/// Calls `run` with the configurations of the unit's models; if it returns false for all of them, with those of the
/// test vectors. Configurations whose encoder sends unsolicited frames are left out.
template <class Run>
void for_each_drive(const Unit& unit, const Run& run) {
  std::vector<Configuration> of_models = configurations(unit);
  std::erase_if(of_models, [](const Configuration& one) { return !one.is_model; });
  std::vector<Configuration> of_vectors;
  for (const Vector& vector : unit.vectors) {
    const auto has_its_options = [&](const Configuration& one) { return one.text == vector.options; };
    if (std::ranges::any_of(of_vectors, has_its_options)) continue;
    const std::optional<Options> options = options_of(unit, vector.options);
    if (options) of_vectors.push_back({std::string(vector.options), *options});
  }
  bool is_any_run = false;
  for (const std::vector<Configuration>& all : {of_models, of_vectors}) {
    for (const Configuration& one : all) {
      const bool is_unsolicited = unit.streams != nullptr && unit.streams(one.options);
      if (!is_unsolicited && run(one)) is_any_run = true;
    }
    if (is_any_run) return;
  }
}

}  // namespace absenc::kit
