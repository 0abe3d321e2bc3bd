// SPDX-License-Identifier: Apache-2.0
// SSI as the neutral layers see it.
#pragma once

#include "absenc/protocol/ssi/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::ssi {

extern constinit const Unit unit;

/// Indices of the unit's options.
enum OptionIndex : std::size_t {
  option_bits,
  option_multiturn_bits,
  option_multiturn_first,
  option_gray,
  option_error_bit,
  option_parity,
  option_after_word,
  option_extra_clocks,
  option_unit_um,
  option_clock_khz,
  option_pause_us,
  option_min_clock_khz,
  option_max_clock_khz,
};

[[nodiscard]] Format to_format(const Options& options);

}  // namespace absenc::ssi
