// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/ssi/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>({0x1E, 0xF0, 0x00, 0x00});
  firmware::run<std::uint8_t, ssi::ReadPosition>(reply, false, ssi::Format{});
}
