// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/joint_settings.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>

#include "absenc/client/error.hpp"
#include "absenc/client/port/setting_value.hpp"

namespace absenc::client {

bool set_joint(Joint& joint, const OptionText& setting) {
  if (setting.name == "direction") {
    joint.direction = choice_of(setting, {"1", "-1"}) == 0 ? 1 : -1;
  } else if (setting.name == "offset_deg" || setting.name == "offset_mm") {
    joint.offset = real_of(setting, 1e9, false);
  } else if (setting.name == "gear") {
    joint.gear = ratio_of(setting);
  } else if (setting.name == "pole_pairs") {
    joint.pole_pairs = static_cast<int>(number_of(setting, 1, 10'000));
    return true;
  } else if (setting.name == "pole_pair_mm") {
    joint.pole_pair_mm = real_of(setting, 1e6, true);
    return true;
  } else {
    return false;
  }
  return joint.is_set = true;
}

void check_joint(std::span<const OptionText> settings, bool is_linear) {
  struct Alternative {
    std::string_view name;
    bool of_linear;
    std::string_view instead;
  };
  constexpr std::array<Alternative, 5> all{{{"offset_deg", false, "set offset_mm=MM"},
                                            {"gear", false, "it has no gear ratio"},
                                            {"pole_pairs", false, "set pole_pair_mm=MM"},
                                            {"offset_mm", true, "set offset_deg=DEG"},
                                            {"pole_pair_mm", true, "set pole_pairs=N"}}};
  for (const OptionText& setting : settings) {
    for (const Alternative& one : all) {
      if (setting.name != one.name || one.of_linear == is_linear) continue;
      throw UsageError(fmt::format("{} cannot be set here, because the encoder {}: {}", one.name,
                                   is_linear ? "is a linear one" : "turns", one.instead));
    }
  }
}

}  // namespace absenc::client
