// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/ssi/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, ssi::ReadPosition>(ssi::Format{});
}
