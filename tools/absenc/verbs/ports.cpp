// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <string>

#include "absenc/client/port/ports.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/port_facts.hpp"
#include "absenc/os/serial_ports.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

using os::ListedPort;

std::string adapter_text(const ListedPort& port) {
  if (!port.usb) return "a UART of this computer";
  const os::UsbAdapter& usb = *port.usb;
  std::string text = usb.maker;
  if (!usb.name.empty()) text += (text.empty() ? "" : " ") + usb.name;
  if (text.empty()) text = fmt::format("USB device {:04x}:{:04x}", usb.vendor, usb.product);
  return usb.serial_number.empty() ? text : fmt::format("{}, serial number {}", text, usb.serial_number);
}

// Returns chip, highest rate, driver and latency of a port, as far as they are known.
std::string way_text(const ListedPort& port) {
  const os::AdapterChip* chip = port.usb ? os::chip_of(*port.usb) : nullptr;
  std::string text = chip != nullptr ? fmt::format("chip {}, ", chip->name) : "";
  text += port.highest_rate ? fmt::format("up to {}", rate_text(*port.highest_rate)) : "greatest rate not known";
  if (!port.driver.empty()) text += fmt::format("; driver {}", port.driver);
  if (port.latency_timer) text += fmt::format("; holds replies back for up to {} ms", *port.latency_timer);
  return text;
}

std::string text_of_serial(const client::FoundPort& listed) {
  const ListedPort& port = listed.serial;
  std::string text = fmt::format("{}: {}\n  {}\n", port.path, adapter_text(port), way_text(port));
  if (!port.lasting_path.empty()) text += fmt::format("  lasting name: {}\n", port.lasting_path);
  if (os::is_modem_driver(port.driver)) return text + "  a mobile modem: no encoder is behind it\n";
  if (!port.refusal.empty()) return text + fmt::format("  {}\n", port.refusal);
  if (!port.holder.empty()) return text + fmt::format("  in use by {}\n", port.holder);
  return text + fmt::format("  free; next: {}\n", listed.next_command());
}

std::string text_of_clock(const client::FoundPort& listed) {
  const ListedPort& port = listed.serial;
  const os::AdapterChip* chip = port.usb ? os::chip_of(*port.usb) : nullptr;
  std::string text = fmt::format("{}: {}\n  chip {}: a clock for BiSS, SSI and EnDat\n", listed.path,
                                 adapter_text(port), chip != nullptr ? chip->name : "of FTDI");
  if (!port.refusal.empty()) return text + fmt::format("  {}\n", port.refusal);
  return text + fmt::format("  next: {}\n", listed.next_command());
}

std::string text_of(const client::FoundPort& port) {
  if (port.kind == "serial") return text_of_serial(port);
  if (port.kind == "ftdi") return text_of_clock(port);
  const std::string_view words = port.kind == "can" ? "a CAN interface" : "an SPI controller";
  return fmt::format("{}: {}\n  next: {}\n", port.path, words, port.next_command());
}

int run_ports(const Invocation& invocation) {
  const bool json = invocation.has("--json");
  std::string text;
  for (const client::FoundPort& port : client::ports()) text += json ? to_json(port).line() + '\n' : text_of(port);
  if (!text.empty()) {
    print_line(text);
  } else if (!json) {
    print_line(
        "This computer has no serial port, no CAN interface, no SPI controller and no FTDI clock: is the adapter "
        "plugged in?\n"
        "Without hardware: absenc read sim:tformat");
  }
  return exit_good;
}

constexpr std::array<Parameter, 1> ports_parameters{{
    {"--json", "", "one JSON object a line, one line for each port"},
}};

constexpr std::array<Example, 2> ports_examples{{
    {"absenc ports", "what is plugged in, and what to type next"},
    {"absenc ports --json", "the same for programs"},
}};

}  // namespace

const Subcommand ports_subcommand{
    "ports",
    "show the ports of this computer: adapter, greatest rate, who holds it, what to type next",
    "No port is opened: that would reset some boards. absenc without a verb does the same. Of a program of another "
    "user,\n"
    "only root sees that it holds a port.",
    ports_parameters,
    ports_examples,
    run_ports};

}  // namespace absenc::tool
