// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/esl/reply.hpp"
#include "firmware/readers/reader.hpp"

namespace {
// The profile is a constant, because a drive knows the profile of its encoder at compile time.
constexpr absenc::esl::Profile profile{};
constexpr absenc::esl::Request request{};
}  // namespace

int main() {
  using namespace absenc;
  static constexpr auto reply = std::to_array<std::uint8_t>(
      {0x08, 0x40, 0x00, 0xEF, 0xCD, 0xAB, 0x34, 0x12, 0x56, 0x46, 0xB3, 0x08, 0x60, 0x00, 0xAB, 0xD6, 0xCD, 0x84});
  firmware::run<std::uint8_t, esl::ReadKnownPosition<profile, request>>(reply, true);
}
