// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/hiperface/frame.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>({0x40, 0x42, 0x00, 0x00, 0xA5, 0xA5, 0x02});
  firmware::run<std::uint8_t, author::ReadPosition<hiperface::Protocol>>(reply, true, hiperface::Format{},
                                                                         hiperface::Request{});
}
