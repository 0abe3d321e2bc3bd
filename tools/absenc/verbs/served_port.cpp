// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/verbs/served_port.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>

#include "absenc/client/emulation/attended.hpp"
#include "absenc/client/emulation/serve_forever.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/echo.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/socketcan.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

void tell_of_port(const std::string& name, PortEvent what, std::string_view why) {
  switch (what) {
    case PortEvent::opened:
      return print_line(fmt::format("ready: {}", name));
    case PortEvent::away:
      return print_message(fmt::format("{}\n  Waiting for it to come back.", why));
    case PortEvent::back:
      return print_message(fmt::format("the port {} is back", name));
  }
}

// Runs the machine until a signal arrives or the time `end` is reached; opens a lost port again.
template <class Item, class Open>
void serve_as(Machine<Item>& machine, const std::string& name, Time end, const Open& open) {
  const auto with_end = [&] {
    auto port = open();
    port->set_end(end);
    return port;
  };
  const auto wait = [end](Time time) {
    if (os::now() >= end) throw os::Ended{};
    os::sleep_until(std::min(time, end));
  };
  try {
    serve_forever(machine, with_end, wait,
                  [&](PortEvent what, std::string_view why) { tell_of_port(name, what, why); });
  } catch (const os::Interrupted&) {
  } catch (const os::Ended&) {
  }
}

}  // namespace

EncoderAddress parse_served_port(const Unit& unit, std::string_view text) {
  const EncoderAddress uri = parse_address(fmt::format("{}:{}", unit.id, text));
  if (uri.port_kind != PortKind::serial) {
    throw UsageError(fmt::format("--port is \"{}\", but must be a serial port, as in {}", text, os::example_port(1)));
  }
  std::string_view rest = text.substr(std::min(text.find('?'), text.size()));
  while (!rest.empty()) {
    rest.remove_prefix(1);
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view name = split_setting(rest.substr(0, end)).name;
    if (find_link_parameter(name) == nullptr) {
      throw UsageError(fmt::format("{} is no setting of a port: write --option or --model for the encoder", name));
    }
    rest.remove_prefix(end);
  }
  return uri;
}

void serve_port(Machine<std::uint8_t>& device, const EncoderAddress& uri, Time end) {
  // Only a host can detect echo, because it sends first: echo=auto means off here.
  host::EchoFilter line(uri.echo == host::EchoMode::on ? host::EchoMode::on : host::EchoMode::off);
  line.attach(device);
  serve_as(static_cast<Machine<std::uint8_t>&>(line), uri.path, end, [&] {
    auto port = std::make_unique<os::SerialPort>(uri.path, uri.line, uri.rs485);
    if (uri.latency) port->set_latency(*uri.latency);
    port->set_send_slack(send_slack);
    return port;
  });
}

void serve_interface(Machine<CanFrame>& device, const std::string& interface, const LineSettings& line, Time end) {
  serve_as(device, interface, end, [&] { return std::make_unique<os::SocketCan>(interface, line); });
}

}  // namespace absenc::tool
