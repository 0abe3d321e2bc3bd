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

/// Returns the wires of a link by their names in --channel.
[[nodiscard]] std::span<const std::string_view> wires_of(LinkKind link);

/// The channel of each wire of the link, in the order of `wires_of`; nothing for a wire that was not recorded.
struct WireChannels {
  std::vector<std::optional<unsigned>> wires;
  bool found = false;  // full duplex: false if neither --channel nor the names tell the host's wire from the device's
};

/// Assigns channels by --channel ("D0", "clock=D0"), otherwise by their names and their number. Throws UsageError,
/// which lists the channels.
[[nodiscard]] WireChannels find_wires(LinkKind link, std::span<const std::string> channels,
                                      std::span<const std::string> wanted);

/// Returns a channel by its name, in upper or lower case, or by its number. Throws UsageError.
[[nodiscard]] unsigned find_channel(std::span<const std::string> channels, std::string_view name);

}  // namespace absenc::client
