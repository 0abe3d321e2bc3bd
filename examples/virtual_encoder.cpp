// SPDX-License-Identifier: Apache-2.0
// A virtual encoder in the test of a drive. Its port opens like that of a real encoder.
#include <cstdio>

#include "absenc/client/emulate.hpp"
#include "absenc/client/encoder.hpp"

using namespace absenc;

int main() {
  client::Emulation emulation = client::emulate("tformat?singleturn=65536");
  // this example reads the virtual encoder itself; in a real test the drive opens the port emulation.path()
  client::Encoder encoder = client::open(emulation.address());
  Reading reading = encoder.read();
  if (!reading.singleturn_valid() || reading.singleturn != 65536) return 1;

  emulation.raise_alarm("over_heat");
  reading = encoder.read();
  for (const client::Flags& flags : client::alarms_of(emulation.unit(), reading)) {
    if (flags.bits == 0) return 1;
  }
  emulation.power_off();
  try {
    reading = encoder.read();
    return 1;
  } catch (const client::EncoderFailure& failure) {
    std::printf("%s\n", failure.what());
  }
  return emulation.violations() == 0 ? 0 : 1;
}
