// SPDX-License-Identifier: Apache-2.0
// The E201-9S as the neutral layers see it.
#pragma once

#include "absenc/protocol/e201/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::e201 {

extern constinit const Unit unit;

/// Indices of the unit's options.
enum OptionIndex : std::size_t {
  option_singleturn_bits,
  option_multiturn_bits,
  option_multiturn_first,
  option_position_bits,
  option_unit_um,
  option_carries,
  option_gray,
  option_after_word,
  option_latency_us,
  option_line_delay_ns,
  option_firmware,
};

[[nodiscard]] Format to_format(const Options& options);

}  // namespace absenc::e201
