// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/link.hpp"

#include <fmt/format.h>

#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/spi_port.hpp"
#include "absenc/os/tcp.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::tool {

namespace {

void take(Link& link, std::shared_ptr<os::StreamPort> port, const EncoderUri& uri) {
  if (uri.latency) port->set_latency(*uri.latency);
  link.latency = port->latency();
  link.bytes = port.get();
  link.owner = std::move(port);
}

Link open_serial(const EncoderUri& uri) {
  Link link;
  const auto port = std::make_shared<os::SerialPort>(uri.path, uri.line, uri.rs485);
  link.place = fmt::format("{} at {} baud", uri.path, uri.line.rate);
  link.notes = port->notes();
  take(link, port, uri);
  return link;
}

Link open_tcp(const EncoderUri& uri) {
  Link link;
  link.place = fmt::format("{}:{}", uri.host, uri.port);
  take(link, std::make_shared<os::TcpPort>(uri.host, uri.port), uri);
  return link;
}

Link open_spi(const EncoderUri& uri) {
  Link link;
  const auto port = std::make_shared<os::SpiPort>(uri.path, uri.unit->link, uri.line, uri.spi);
  link.place = fmt::format("{} in SPI mode {}", uri.path, port->settings().spi_mode);
  link.bytes = port.get();
  link.owner = port;
  return link;
}

// Virtual time keeps pace with ours, so that a moving shaft moves.
Link open_sim(const EncoderUri& uri) {
  Link link;
  link.place = "the virtual encoder";
  link.device = std::make_unique<VirtualDevice>(*uri.unit, uri.options, uri.device);
  link.device->power_on(Time{});
  const sim::RealTime real_time{.now = os::now, .sleep_until = os::sleep_until};
  const auto open = [&]<class Item>(Machine<Item>& device, Port<Item>*& port) {
    const auto made = std::make_shared<sim::SimPort<Item>>(uri.unit->link, uri.line, device, real_time);
    port = made.get();
    link.owner = made;
  };
  if (link.device->bytes() != nullptr) {
    open(*link.device->bytes(), link.bytes);
  } else {
    open(*link.device->frames(), link.frames);
  }
  return link;
}

}  // namespace

Link open_link(const EncoderUri& uri) {
  switch (uri.place) {
    case Place::serial:
      return open_serial(uri);
    case Place::tcp:
      return open_tcp(uri);
    case Place::spi:
      return open_spi(uri);
    case Place::sim:
      break;
  }
  return open_sim(uri);
}

}  // namespace absenc::tool
