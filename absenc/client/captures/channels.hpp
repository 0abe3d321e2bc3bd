// SPDX-License-Identifier: Apache-2.0
// Assigns the channels of a capture to the wires of a link.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/link/line.hpp"

namespace absenc::client {

/// Returns the names of a link's wires; --channel also accepts other names for them.
[[nodiscard]] std::span<const std::string_view> wires_of(LinkKind link);

/// The index of the capture's channel for each wire of the link, in the order of `wires_of`; no value for a wire that
/// was not recorded.
struct WireChannels {
  std::vector<std::optional<unsigned>> wires;
  bool assumed = false;  // full duplex: whether a --channel value names no wire, or channels were assigned in order
};

/// Assigns channels by --channel ("D0", "clock=D0"); without it, by the channels' names or, if no name fits, in order
/// (not on clocked lines and SPI, nor with more channels than wires). Throws UsageError, which lists the channels or
/// wires, for an unknown name, for more --channel values than wires, for a needed wire without a channel, and if no
/// wire has one.
[[nodiscard]] WireChannels find_wires(LinkKind link, std::span<const std::string> channels,
                                      std::span<const std::string> wanted);

/// Returns the index of the channel `name`, which is a channel's name in upper or lower case, or its number from 0.
/// Throws UsageError if there is no such channel.
[[nodiscard]] unsigned find_channel(std::span<const std::string> channels, std::string_view name);

}  // namespace absenc::client
