// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/raa38/modbus/frame.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>({0x01, 0x03, 0x02, 0x01, 0x7F, 0xF8, 0x34});
  firmware::run<std::uint8_t, raa38::rtu::ReadPosition>(reply, true, raa38::rtu::Format{}, raa38::rtu::Request{});
}
