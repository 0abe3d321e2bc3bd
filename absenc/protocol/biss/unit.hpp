// SPDX-License-Identifier: Apache-2.0
// BiSS-C as the neutral layers see it.
#pragma once

#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/biss/frame.hpp"
#include "absenc/protocol/biss/host.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::biss {

extern constinit const Unit unit;

/// Indices of the unit's options.
enum OptionIndex : std::size_t {
  option_singleturn_bits,
  option_multiturn_bits,
  option_multiturn_first,
  option_position_bits,
  option_unit_um,
  option_check,
  option_ma_khz,
  option_latency_us,
  option_line_delay_ns,
  option_ready_us,
};

[[nodiscard]] Format to_format(const Options& options);

}  // namespace absenc::biss
