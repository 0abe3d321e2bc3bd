// SPDX-License-Identifier: Apache-2.0
// Reader for Saleae Logic 2's binary export of digital channels, with one file per channel.
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

/// Returns whether a file that begins with `head` is a binary export of Saleae.
[[nodiscard]] bool is_saleae(std::string_view head);

/// Returns "Channel 3" for "digital_3", as Logic 2 names its files; another name unchanged.
[[nodiscard]] std::string saleae_channel_name(std::string_view stem);

/// Reads binary exports of versions 0 and 1, little endian, after "<SALEAE>", int32 version and int32 type (0:
/// digital):
///
/// - 0: uint32 initial state, double begin and end in seconds, uint64 number of transitions, a double with the time of
///   each transition
/// - 1: uint64 number of chunks; each like version 0, with a double sample rate behind the initial state
///
/// Ticks are picoseconds from the earliest begin of all channels. If one channel is damaged, all channels end there.
/// Throws OpenError.
[[nodiscard]] std::unique_ptr<Reader> read_saleae(std::vector<SaleaeChannel> channels);

}  // namespace absenc::capture
