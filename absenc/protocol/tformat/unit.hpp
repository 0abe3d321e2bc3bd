// SPDX-License-Identifier: Apache-2.0
// The T-format as the neutral layers see it.
#pragma once

#include "absenc/protocol/tformat/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::tformat {

extern constinit const Unit unit;

/// Indices of the unit's options.
enum OptionIndex : std::size_t { option_singleturn_bits, option_multiturn_bits, option_encoder_id, option_strict };

[[nodiscard]] Format to_format(const Options& options);

}  // namespace absenc::tformat
