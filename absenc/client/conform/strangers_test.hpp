// SPDX-License-Identifier: Apache-2.0
// Random senders without a protocol, for tests of encoders and of hosts.
#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

#include "absenc/link/can.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::client {

/// Returns 1 to `most` random bytes or CAN frames.
template <class Item>
std::vector<Item> noise(sim::Random& random, std::size_t most) {
  std::vector<Item> items(1 + random.below(most));
  for (Item& item : items) {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      item = {.id = static_cast<std::uint32_t>(random.below(0x800)), .size = 8};
      for (std::uint8_t& byte : item.data) byte = static_cast<std::uint8_t>(random.below(256));
    } else {
      item = static_cast<std::uint8_t>(random.below(256));
    }
  }
  return items;
}

}  // namespace absenc::client
