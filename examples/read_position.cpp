// SPDX-License-Identifier: Apache-2.0
// Reads a Smart-Abs once, at the port in the argument or on a simulated line.
#include <cstdio>

#include "absenc/host/drive.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/sim/motion.hpp"
#include "absenc/sim/sim_port.hpp"

using namespace absenc;

int read_from(Port<std::uint8_t>& port) {
  // [readme]
  tformat::ReadPosition read{tformat::Format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11}};
  host::drive(read, port, [] { return true; });  // on a microcontroller, the interrupts of your UART call feed and next

  if (read.error() != Error::none) {
    std::printf("%s\n", text_of(read.error()).description.data());
    return 1;
  }
  const Reading& reading = *read.reading();
  if (reading.singleturn_valid()) {
    std::printf("%.4f degrees\n", degrees(reading.singleturn, reading.singleturn_bits));
  }
  if (reading.multiturn_valid) {
    std::printf("%llu turns\n", static_cast<unsigned long long>(reading.multiturn));
  }
  // [readme]
  return 0;
}

int main(int argc, char** argv) {
  if (argc > 1) {
    os::SerialPort port(argv[1], tformat::line_settings);
    return read_from(port);
  }
  const sim::Motion shaft = sim::Motion::still(std::int64_t{7} << 32 | 0x4000'0000);  // the shaft is at 7 1/4 turns
  tformat::VirtualEncoder encoder({}, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  sim::SimPort<std::uint8_t> port(LinkKind::half_duplex, tformat::line_settings, encoder);
  return read_from(port);
}
