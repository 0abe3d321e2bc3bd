// SPDX-License-Identifier: Apache-2.0
// Writes the waveform that an FTDI chip drives for some readings, or for a command, with a virtual encoder on its pins.
// Usage: ftdi_wave PROTOCOL[?settings] COMMAND COUNT FILE. Prints the clock rate of the port in Hz.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <vector>

#include "absenc/client/port/address.hpp"
#include "absenc/client/port/virtual_device.hpp"
#include "absenc/host/drive.hpp"
#include "absenc/os/fake_ftdi_test.hpp"
#include "absenc/os/ftdi_port.hpp"

using namespace absenc;

namespace {

int run(const std::string& what, const char* name, int count, const char* path) {
  const client::EncoderAddress address = client::parse_address("sim:" + what);
  const Unit& unit = *address.unit;
  client::VirtualDevice device(unit, address.options, address.device);
  device.power_on(os::now());
  ftdi::EncoderWires wires(unit.link, address.line, *device.bytes());
  wires.record();
  os::testing::FakeFtdi usb(wires);
  os::FtdiPort port("", unit.link, address.line, {}, usb);
  const Command* command = find_command(unit, name);
  if (command == nullptr) return 2;
  std::vector<std::byte> storage(unit.host_storage);
  bool failed = false;
  for (int i = 0; i < count; ++i) {
    const auto host = unit.host(address.options, *command, {}, storage);
    if (!host::drive(*host.bytes, port, [] { return true; })) return 1;
    if (const Error error = host.bytes->error(); error != Error::none) {
      std::fprintf(stderr, "%s\n", std::string(text_of(error).description).c_str());
      failed = true;
      break;
    }
  }
  wires.pass(os::now() + std::chrono::milliseconds(1));
  std::ofstream file(path);
  wires.write_vcd(file);
  std::printf("%u\n", port.settings().rate);
  return usb.mpsse.misused() == 0 && !failed ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) return 2;
  try {
    return run(arguments[1], arguments[2], std::atoi(arguments[3]), arguments[4]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
