// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/raa38/can/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<CanFrame>({{.id = 0x120, .size = 8, .data = {0x20}}});
  firmware::run<CanFrame, raa38::can::Read>(reply, false, raa38::can::Format{}, raa38::can::Read::Mode::ask);
}
