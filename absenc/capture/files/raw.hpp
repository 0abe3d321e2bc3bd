// SPDX-License-Identifier: Apache-2.0
// Reader for raw samples without a header: 1, 2, 4 or 8 bytes each, little endian, channel 0 in bit 0.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns the number of bytes per sample, 1, 2, 4 or 8, for a number of channels from 1 to 64.
[[nodiscard]] constexpr unsigned bytes_per_sample(unsigned channels) {
  return channels <= 8 ? 1 : channels <= 16 ? 2 : channels <= 32 ? 4 : 8;
}

/// Reads raw samples of 1 to 64 channels. Throws OpenError.
[[nodiscard]] std::unique_ptr<Reader> read_raw(std::unique_ptr<Source> source, std::string_view name, unsigned channels,
                                               std::uint64_t samples_per_second);

}  // namespace absenc::capture
