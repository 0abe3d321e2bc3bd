// SPDX-License-Identifier: Apache-2.0
// Which channel of a capture is which wire of a link.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/link/line.hpp"

namespace absenc::client {

/// The wires of a link, by the names that --channel has for them.
[[nodiscard]] std::span<const std::string_view> wires_of(LinkKind link);

/// The channel of each wire of the link, in the order of `wires_of`; nothing where a wire was not recorded.
struct WireChannels {
  std::vector<std::optional<unsigned>> wires;
  bool found = false;  // full duplex: nobody said which of the two is whose, and their names do not tell
};

/// From what --channel says ("D0", "clock=D0"), and where it says nothing, from the names and the number of the
/// channels. Throws UsageError, which lists the channels.
[[nodiscard]] WireChannels find_wires(LinkKind link, std::span<const std::string> channels,
                                      std::span<const std::string> wanted);

/// A channel by its name, in any case, or its number. Throws UsageError.
[[nodiscard]] unsigned find_channel(std::span<const std::string> channels, std::string_view name);

}  // namespace absenc::client
