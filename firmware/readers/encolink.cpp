// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/encolink/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>({0xFF, 0xFF, 0x83, 0x15, 0x00});
  firmware::run<std::uint8_t, encolink::ReadPosition>(reply, true,
                                                      encolink::Format{.resolution = 17, .multiturn_bits = 0});
}
