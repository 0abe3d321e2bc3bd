// SPDX-License-Identifier: Apache-2.0
// Reader for raw samples without a header: 1, 2, 4 or 8 bytes each, the fewest that hold all channels, little endian,
// channel 0 in bit 0.
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

/// Reads raw samples of `channels` channels. Throws OpenError if `channels` is not 1 to 64 or the rate is 0. An
/// incomplete sample at the end of the file is a damage.
[[nodiscard]] std::unique_ptr<Reader> read_raw(std::unique_ptr<Source> source, std::string_view name, unsigned channels,
                                               std::uint64_t samples_per_second);

}  // namespace absenc::capture
