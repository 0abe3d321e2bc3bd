// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/endat/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  // position 0x1234567 of an encoder with 25 bits, by the mode command of EnDat 2.2
  static constexpr auto reply = std::to_array<std::uint8_t>({0x2F, 0x35, 0x16, 0x25, 0x00});
  firmware::run<std::uint8_t, endat::ReadPosition>(reply, false, endat::Format{.singleturn_bits = 25},
                                                   endat::Request{.code = endat::ModeCommand::position_22});
}
