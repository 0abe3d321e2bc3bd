// SPDX-License-Identifier: Apache-2.0
// What the options of the serial unit mean.
#pragma once

#include "absenc/protocol/options.hpp"
#include "absenc/protocol/raa38/serial/settings.hpp"

namespace absenc::raa38::serial {

/// Indices of the unit's options.
enum OptionIndex : std::size_t {
  option_mode,
  option_bits,
  option_unit,
  option_second_byte,
  option_zeroing,
  option_zero_unit,
  option_refresh_hz,
  option_max_rpm,
  option_acquisition_us,
  option_transmission_us,
};

[[nodiscard]] Settings to_settings(const Options& options);

}  // namespace absenc::raa38::serial
