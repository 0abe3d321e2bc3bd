// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/nikon/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>({0x04, 0x00, 0xA6, 0xFF, 0x8F, 0x88, 0x08, 0x5E});
  firmware::run<std::uint8_t, nikon::ReadPosition>(reply, true, nikon::Format{});
}
