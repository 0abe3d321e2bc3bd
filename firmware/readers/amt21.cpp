// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/amt21/unit.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>({0xAB, 0x61});
  firmware::run<std::uint8_t, author::ReadPosition<amt21::Protocol>>(reply, true, amt21::Format{}, amt21::Request{});
}
