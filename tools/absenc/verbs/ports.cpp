// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <string>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/port_facts.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/socketcan.hpp"
#include "absenc/os/spi_port.hpp"
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

// Chip, rate, driver, latency: what is known of them.
std::string way_text(const ListedPort& port) {
  const os::AdapterChip* chip = port.usb ? os::chip_of(*port.usb) : nullptr;
  std::string text = chip != nullptr ? fmt::format("chip {}, ", chip->name) : "";
  text += port.highest_rate ? fmt::format("up to {}", rate_text(*port.highest_rate)) : "greatest rate not known";
  if (!port.driver.empty()) text += fmt::format("; driver {}", port.driver);
  if (port.latency_timer) text += fmt::format("; holds replies back for up to {} ms", *port.latency_timer);
  return text;
}

std::string text_of(const ListedPort& port) {
  std::string text = fmt::format("{}: {}\n  {}\n", port.path, adapter_text(port), way_text(port));
  if (!port.lasting_path.empty()) text += fmt::format("  lasting name: {}\n", port.lasting_path);
  if (os::is_modem_driver(port.driver)) return text + "  a mobile modem: no encoder is behind it\n";
  if (!port.refusal.empty()) return text + fmt::format("  {}\n", port.refusal);
  if (!port.holder.empty()) return text + fmt::format("  in use by {}\n", port.holder);
  return text + fmt::format("  free; next: absenc identify {}\n", port.path);
}

Json json_of(const ListedPort& port) {
  const auto known = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  const os::UsbAdapter usb = port.usb.value_or(os::UsbAdapter{});
  const os::AdapterChip* chip = os::chip_of(usb);
  return Json::object()
      .set("port", port.path)
      .set("kind", "serial")
      .set("lasting_name", known(port.lasting_path))
      .set("maker", known(usb.maker))
      .set("adapter", known(usb.name))
      .set("serial_number", known(usb.serial_number))
      .set("chip", chip != nullptr ? Json(chip->name) : Json())
      .set("driver", known(port.driver))
      .set("latency_timer_ms", port.latency_timer ? Json(*port.latency_timer) : Json())
      .set("highest_rate", port.highest_rate ? Json(*port.highest_rate) : Json())
      .set("may_open", port.refusal.empty())
      .set("refusal", known(port.refusal))
      .set("in_use_by", known(port.holder));
}

Json json_of(std::string_view kind, const std::string& name) {
  return Json::object().set("port", name).set("kind", kind);
}

int run_ports(const Invocation& invocation) {
  const bool json = invocation.has("--json");
  std::string text;
  for (const std::string& path : os::serial_ports()) {
    const ListedPort port = os::look_at(path);
    text += json ? json_of(port).line() + '\n' : text_of(port);
  }
  const auto add = [&](std::string_view kind, std::string_view words, std::string_view place,
                       const std::vector<std::string>& names) {
    for (const std::string& name : names) {
      text += json ? json_of(kind, name).line() + '\n'
                   : fmt::format("{0}: {1}\n  next: absenc identify {2}{0}\n", name, words, place);
    }
  };
  add("can", "a CAN interface", "", os::can_interfaces());
  add("spi", "an SPI controller", "spi:", os::spi_devices());
  if (!text.empty()) {
    print_line(text);
  } else if (!json) {
    print_line(
        "This computer has no serial port, no CAN interface and no SPI controller: is the adapter plugged in?\n"
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
