// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, tformat::ReadPosition>(tformat::Format{});
}
