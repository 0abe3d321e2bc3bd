// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/tformat/host.hpp"
#include "firmware/readers/reader.hpp"

namespace {
// The format is a constant, because a drive knows the format of its encoder at compile time.
constexpr absenc::tformat::Format format{};
}  // namespace

int main() {
  using namespace absenc;
  static constexpr auto reply =
      std::to_array<std::uint8_t>({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});
  firmware::run<std::uint8_t, tformat::ReadKnownPosition<format>>(reply, true);
}
