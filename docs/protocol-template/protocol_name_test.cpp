// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>

#include "absenc/protocol/protocol_name/unit.hpp"

namespace absenc::protocol_name {
namespace {

// The kit (tests/kit) tests what every unit has; here stands what only this encoder does.
TEST(ProtocolNameUnit, HasBothRoles) {
  EXPECT_GT(unit.host_storage, 0u) << "write host.hpp: one class a conversation";
  EXPECT_GT(unit.device_storage, 0u) << "write device.hpp: the virtual encoder";
}

TEST(ProtocolNameUnit, EncodesItsFirstCommand) {
  std::array<std::uint8_t, 64> request{};
  EXPECT_TRUE(unit.encode({}, unit.commands[0], {}, request).has_value()) << "write encode in unit.cpp";
}

}  // namespace
}  // namespace absenc::protocol_name
