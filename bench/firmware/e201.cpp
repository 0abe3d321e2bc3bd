// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/host.hpp"
#include "bench/firmware/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, e201::ReadPosition>(e201::Format{});
}
