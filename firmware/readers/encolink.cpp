// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/host.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, encolink::ReadPosition>(encolink::Format{.resolution = 20, .multiturn_bits = 16});
}
