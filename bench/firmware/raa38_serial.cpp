// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/host.hpp"
#include "bench/firmware/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, raa38::serial::ReadPosition>(raa38::serial::Settings{.mode = raa38::serial::Mode::bus});
}
