// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/amt21/unit.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, author::ReadPosition<amt21::Protocol>>(amt21::Format{}, amt21::Request{});
}
