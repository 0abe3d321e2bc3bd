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

/// For each wire in the order of `wires_of`, the channel that recorded it; nothing if no channel did.
struct WireChannels {
  std::vector<std::optional<unsigned>> wires;
  // whether the channels of a full-duplex line were assigned without names of wires, so that host and encoder may be
  // swapped
  bool assumed = false;
};

/// Assigns channels to wires as the option --channel states ("D0", "clock=D0"); without the option, by the names or the
/// order of the channels. Throws UsageError.
[[nodiscard]] WireChannels find_wires(LinkKind link, std::span<const std::string> channels,
                                      std::span<const std::string> wanted);

/// Returns the index of the channel `name`, a name in upper or lower case or a number from 0. Throws UsageError.
[[nodiscard]] unsigned find_channel(std::span<const std::string> channels, std::string_view name);

}  // namespace absenc::client
