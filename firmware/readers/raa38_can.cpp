// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<CanFrame, raa38::can::Read>(raa38::can::Format{}, raa38::can::Read::Way::ask);
}
