// SPDX-License-Identifier: Apache-2.0
// Saleae Logic 2's binary export of digital channels, a file for each.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

struct SaleaeChannel {
  std::string name;
  std::unique_ptr<Source> source;
};

/// True when a file that begins so is such an export, digital or analog.
[[nodiscard]] bool is_saleae(std::string_view head);

/// "digital_3" (without ".bin"), as Logic 2 names the file of its "Channel 3", gives that; anything else itself.
[[nodiscard]] std::string saleae_channel_name(std::string_view stem);

/// Reads versions 0 and 1, little endian, after "<SALEAE>", int32 version and int32 type (0: digital):
///
/// - 0: uint32 initial state, double begin and end in seconds, uint64 number of transitions, a double for each
/// - 1: uint64 number of chunks; each as version 0, with a double sample rate behind the initial state. The level
/// stands
///   still in the gaps between chunks, which are noted.
///
/// Ticks are picoseconds from the earliest begin of all channels on. Where one channel is damaged or cut off, all end.
/// Throws OpenError when the beginning of a file makes no sense.
[[nodiscard]] std::unique_ptr<Reader> read_saleae(std::vector<SaleaeChannel> channels);

}  // namespace absenc::capture
