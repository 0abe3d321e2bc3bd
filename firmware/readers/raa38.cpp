// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/raa38/serial/frame.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>({0xFF, 0x81, 0x01, 0x7F, 0x00});
  firmware::run<std::uint8_t, raa38::serial::ReadPosition>(
      reply, true, raa38::serial::Format{.mode = raa38::serial::Mode::bus}, raa38::serial::Request{});
}
