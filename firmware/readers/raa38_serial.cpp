// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/frame.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, raa38::serial::ReadPosition>(raa38::serial::Format{.mode = raa38::serial::Mode::bus},
                                                           raa38::serial::Request{});
}
