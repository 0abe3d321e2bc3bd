// SPDX-License-Identifier: Apache-2.0
// Program for can_test.py that runs a virtual encoder of the library on a CAN interface. Usage: can_emulation INTERFACE
#include <cstdio>
#include <string>
#include <vector>

#include "absenc/client/emulate.hpp"
#include "absenc/client/encoder.hpp"

using namespace absenc;

int main(int count, char** arguments) {
  if (count != 2) return 2;
  client::Emulation emulation = client::emulate("raa38-can?singleturn=9799", {.can = arguments[1]});
  client::Encoder encoder = client::open(emulation.address(), std::vector<std::string>{"latency=2000"});
  std::printf("%s %llu\n", emulation.address().c_str(), static_cast<unsigned long long>(encoder.read().singleturn));
  std::fflush(stdout);
  while (std::getchar() != EOF) {
    emulation.power_off();  // switches the power of the encoder, which is possible also while the interface is down
    emulation.power_on();
    std::puts("switched");
    std::fflush(stdout);
  }
  return emulation.answer_count() > 0 ? 0 : 1;
}
