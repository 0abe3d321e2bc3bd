// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "absenc/protocol/protocol_name/unit.hpp"

namespace absenc::protocol_name {
namespace {

// The kit (tests/kit) tests the behaviour that all units share; add tests here for the contents of this document.
TEST(ProtocolName, DocumentIsNotTheInventedOne) {
  EXPECT_NE(unit.document, "title of the document") << "put the document's own frames in place of the invented ones";
}

}  // namespace
}  // namespace absenc::protocol_name
