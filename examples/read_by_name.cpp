// SPDX-License-Identifier: Apache-2.0
// Reads any encoder by an address of the command: tformat:/dev/ttyUSB0, sim:esl, elbow.
#include <cstdio>
#include <exception>
#include <optional>

#include "absenc/client/encoder.hpp"

using namespace absenc;

int main(int argc, char** argv) try {
  // [readme]
  client::Encoder encoder = client::open(argc > 1 ? argv[1] : "sim:tformat?motion=rpm=60");
  for (const client::Sample& sample : encoder.samples({.rate_hz = 100, .count = 200})) {
    if (sample.kind != client::Sample::Kind::reading) {
      std::printf("%s\n", sample.text().c_str());
      continue;
    }
    const Reading& reading = sample.reading;
    if (!reading.singleturn_valid()) continue;  // the position is not confirmed, or the encoder reports it as invalid
    std::printf("%.4f degrees\n", degrees(reading.singleturn, reading.singleturn_bits));
    const std::optional<client::Estimate> speed = sample.speed_rpm();
    if (speed) std::printf("%.1f rpm, within %.1f\n", speed->value, speed->uncertainty);
  }
  // [readme]
} catch (const std::exception& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 1;
}
