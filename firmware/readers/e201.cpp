// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/e201/frame.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>(
      {0x63, 0x30, 0x30, 0x31, 0x34, 0x33, 0x32, 0x38, 0x66, 0x66, 0x33, 0x30, 0x30, 0x30, 0x30, 0x30, 0x0D});
  firmware::run<std::uint8_t, author::ReadPosition<e201::Protocol>>(reply, true, e201::Format{}, e201::Request{});
}
