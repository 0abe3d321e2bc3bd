// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/ports.hpp"

#include <fmt/format.h>

#include "absenc/client/port/address.hpp"
#include "absenc/os/ftdi_usb.hpp"
#include "absenc/os/port_facts.hpp"
#include "absenc/os/socketcan.hpp"
#include "absenc/os/spi_port.hpp"

namespace absenc::client {

std::string FoundPort::next_command() const {
  if (!serial.refusal.empty() || !serial.holder.empty() || os::is_modem_driver(serial.driver)) return {};
  return fmt::format("absenc identify {}{}", kind == "spi" ? "spi:" : "", path);
}

std::vector<FoundPort> ports() {
  std::vector<FoundPort> all;
  for (const std::string& path : os::serial_ports()) all.push_back({path, "serial", os::inspect_port(path)});
  for (const std::string& interface : os::can_interfaces()) all.push_back({interface, "can"});
  for (const std::string& device : os::spi_devices()) all.push_back({device, "spi"});
  for (const os::FtdiAdapter& adapter : os::system_ftdi().adapters()) {
    for (unsigned channel = 0; channel < adapter.channels; ++channel) {
      const std::string letter = adapter.channels > 1 ? fmt::format("/{}", static_cast<char>('A' + channel)) : "";
      const std::string path = ftdi_place(adapter.usb.serial_number + letter);
      all.push_back({path, "ftdi", {.path = path, .usb = adapter.usb, .refusal = adapter.refusal}});
    }
  }
  return all;
}

Json to_json(const FoundPort& port) {
  Json json = Json::object().set("port", port.path).set("kind", port.kind);
  if (port.kind != "serial" && port.kind != "ftdi") return json;
  const auto known = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  const os::ListedPort& serial = port.serial;
  const os::UsbAdapter usb = serial.usb.value_or(os::UsbAdapter{});
  const os::AdapterChip* chip = os::chip_of(usb);
  return json.set("lasting_name", known(serial.lasting_path))
      .set("maker", known(usb.maker))
      .set("adapter", known(usb.name))
      .set("serial_number", known(usb.serial_number))
      .set("chip", chip != nullptr ? Json(chip->name) : Json())
      .set("driver", known(serial.driver))
      .set("latency_timer_ms", serial.latency_timer ? Json(*serial.latency_timer) : Json())
      .set("highest_rate", serial.highest_rate ? Json(*serial.highest_rate) : Json())
      .set("may_open", serial.refusal.empty())
      .set("refusal", known(serial.refusal))
      .set("in_use_by", known(serial.holder));
}

}  // namespace absenc::client
