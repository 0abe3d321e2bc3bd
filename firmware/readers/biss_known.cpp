// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/biss/host.hpp"
#include "firmware/readers/reader.hpp"

namespace {
// The format is a constant, because a drive knows the format of its encoder at compile time.
constexpr absenc::biss::Format format{};
}  // namespace

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>({0xC0, 0x28, 0x65, 0x1F, 0xE6, 0x00, 0x00, 0x00});
  firmware::run<std::uint8_t, biss::ReadKnownPosition<format>>(reply, false);
}
