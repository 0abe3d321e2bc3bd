// SPDX-License-Identifier: Apache-2.0
// EncoLink as the neutral layers see it: one unit for each wire.
#pragma once

#include "absenc/protocol/encolink/device.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

extern constinit const Unit unit;      // UART
extern constinit const Unit spi_unit;  // SPI

/// Indices of the units' options.
enum OptionIndex : std::size_t {
  option_resolution,
  option_multiturn_bits,
  option_has_ch2,
  option_offset_sign,
  option_stream_rate,
  option_offset_unit,
  option_protocol_version,
  option_identity_bytes,
};

[[nodiscard]] Format to_format(const Options& options);
[[nodiscard]] Build to_build(const Options& options);

}  // namespace absenc::encolink
