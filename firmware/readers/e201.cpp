// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/frame.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, author::ReadPosition<e201::Protocol>>(e201::Format{}, e201::Request{});
}
