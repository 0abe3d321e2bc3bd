// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/frame.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, raa38::rtu::ReadPosition>(raa38::rtu::Format{}, raa38::rtu::Request{});
}
