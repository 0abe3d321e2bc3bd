// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/link.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <type_traits>

#include "absenc/client/error.hpp"
#include "absenc/client/port/can_log.hpp"
#include "absenc/client/port/realtime.hpp"
#include "absenc/os/ftdi_port.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/slcan_port.hpp"
#include "absenc/os/socketcan.hpp"
#include "absenc/os/spi_port.hpp"
#include "absenc/os/tcp.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::client {

namespace {

template <class AnyPort>
void take(Link& link, std::shared_ptr<AnyPort> port, const EncoderAddress& uri) {
  if (uri.latency) port->set_latency(*uri.latency);
  link.latency = port->latency();
  if constexpr (std::is_base_of_v<os::FramePort, AnyPort>) {
    link.frames = port.get();
  } else {
    link.bytes = port.get();
  }
  link.owner = std::move(port);
}

ExtraWires extra_wires(const EncoderAddress& uri) {
  return uri.unit->extra_wires == nullptr ? ExtraWires{} : uri.unit->extra_wires(uri.options);
}

// Returns the line settings of a serial port. A port that did not exist when its address was parsed may be a
// pseudo-terminal, which needs no rate.
LineSettings line_of_serial(const EncoderAddress& uri) {
  if (uri.line.rate != 0 || os::is_pseudo_terminal(uri.path)) return uri.line.with_some_rate();
  throw UsageError(
      fmt::format("the document of {0} states no baud rate: say what yours was ordered with, as in "
                  "\"{0}:{1}?baud=9600\"",
                  uri.unit->id, uri.path));
}

Link open_serial(const EncoderAddress& uri) {
  if (extra_wires(uri).trigger && uri.wires.trigger.kind == os::PulseWire::Kind::none) {
    throw UsageError(
        fmt::format("with these options a pulse asks {} for each frame: say which wire carries it, trigger=rts, "
                    "trigger=dtr or trigger=gpio:NAME",
                    uri.unit->id));
  }
  Link link;
  const LineSettings line = line_of_serial(uri);
  const auto port = std::make_shared<os::SerialPort>(uri.path, line, uri.rs485, uri.wires);
  link.place = fmt::format("{} at {} baud", uri.path, line.rate);
  link.notes = port->notes();
  link.character = port->character_time();
  take(link, port, uri);
  return link;
}

Link open_tcp(const EncoderAddress& uri) {
  if (extra_wires(uri).trigger) {
    throw UsageError(
        fmt::format("with these options a pulse asks {} for each frame, which TCP does not carry: use a "
                    "serial port",
                    uri.unit->id));
  }
  Link link;
  link.place = fmt::format("{}:{}", uri.host, uri.port);
  take(link, std::make_shared<os::TcpPort>(uri.host, uri.port), uri);
  return link;
}

Link open_serial_receiving(const EncoderAddress& uri) {
  Link link;
  const LineSettings line = line_of_serial(uri);
  const auto port = std::make_shared<os::SerialPort>(uri.path, line, os::Rs485::off, os::PulseWires{},
                                                     os::system_wires(), os::SerialUse::receive);
  link.place = fmt::format("{} at {} baud", uri.path, line.rate);
  link.notes = port->notes();
  take(link, port, uri);
  return link;
}

Link open_spi(const EncoderAddress& uri) {
  Link link;
  const auto port = std::make_shared<os::SpiPort>(uri.path, uri.unit->link, uri.line, uri.spi);
  link.place = fmt::format("{} in SPI mode {}", uri.path, port->settings().spi_mode);
  link.clock_rate = [controller = port.get()] { return controller->clock_rate(); };
  link.bytes = port.get();
  link.owner = port;
  return link;
}

Link open_ftdi(const EncoderAddress& uri) {
  Link link;
  const auto port = std::make_shared<os::FtdiPort>(uri.path, uri.unit->link, uri.line, uri.spi);
  link.place = fmt::format("the {} with a clock of {} Hz", port->name(), port->settings().rate);
  link.clock_rate = [chip = port.get()] { return chip->clock_rate(); };
  link.is_data_driven = [chip = port.get()] { return chip->look_at_data().driven; };
  link.bytes = port.get();
  link.owner = port;
  return link;
}

Link open_can(const EncoderAddress& uri) {
  Link link;
  // `place` names no bit rate, because the system sets the bit rate of the interface, not absenc
  link.place = uri.path;
  take(link, std::make_shared<os::SocketCan>(uri.path, uri.line), uri);
  return link;
}

Link open_slcan(const EncoderAddress& uri) {
  Link link;
  link.place = fmt::format("the CAN adapter at {} at {} bit/s", uri.path, uri.line.rate);
  const LineSettings serial{.rate = uri.adapter_rate};
  const auto bytes = std::make_shared<os::SerialPort>(uri.path, serial, os::Rs485::off);
  link.notes = bytes->notes();
  const auto port = std::make_shared<os::SlcanPort>(bytes, uri.path, uri.line);
  link.notes.insert(link.notes.end(), port->notes().begin(), port->notes().end());
  port->set_latency(bytes->latency());
  take(link, port, uri);
  return link;
}

// Returns the log file of this path; after a loss of the port it is the same file. Must not be called by several
// threads at once.
std::shared_ptr<os::LineFile> log_file(const std::string& path) {
  static std::map<std::string, std::shared_ptr<os::LineFile>> files;
  std::shared_ptr<os::LineFile>& file = files[path];
  if (file == nullptr || file.use_count() > 1) file = std::make_shared<os::LineFile>(path);
  return file;
}

// Puts the CAN log between the link and its port.
void keep_log(Link& link, const EncoderAddress& uri) {
  const std::string name = uri.port_kind == PortKind::sim ? "sim" : std::filesystem::path(uri.path).filename().string();
  auto log = std::make_shared<CanLog>(*link.frames, link.owner, log_file(uri.log), name);
  link.frames = log.get();
  link.owner = std::move(log);
}

// Virtual time follows the real clock, so that a moving shaft moves.
Link open_sim(const EncoderAddress& uri) {
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

Link open_link(const EncoderAddress& uri) {
  const auto open = [&] {
    switch (uri.port_kind) {
      case PortKind::serial:
        return open_serial(uri);
      case PortKind::tcp:
        return open_tcp(uri);
      case PortKind::spi:
        return open_spi(uri);
      case PortKind::ftdi:
        return open_ftdi(uri);
      case PortKind::can:
        return open_can(uri);
      case PortKind::slcan:
        return open_slcan(uri);
      case PortKind::sim:
        break;
    }
    return open_sim(uri);
  };
  require_realtime(uri.realtime);
  Link link = open();
  link.realtime = uri.realtime;
  if (!uri.log.empty()) keep_log(link, uri);
  return link;
}

namespace {

Link open_port_for_receiving(const EncoderAddress& uri) {
  switch (uri.port_kind) {
    case PortKind::serial:
      return open_serial_receiving(uri);
    case PortKind::tcp:
      return open_tcp(uri);
    case PortKind::can:
      throw UsageError(fmt::format("frames of a CAN interface come from candump: candump -L {0} | absenc decode {1} -",
                                   uri.path, uri.unit->id));
    case PortKind::slcan:
      throw UsageError(
          "an slcan adapter has to be asked to receive: make an interface of it with slcand, and use candump");
    case PortKind::spi:
    case PortKind::ftdi:
      throw UsageError("a clocked line is received by a logic analyser: see `absenc decode --help`");
    case PortKind::sim:
      break;
  }
  throw UsageError("a virtual encoder inside this command has no line: `absenc emulate` makes one");
}

}  // namespace

Link open_receiving(const EncoderAddress& uri) {
  Link link = open_port_for_receiving(uri);
  link.realtime = uri.realtime;
  return link;
}

}  // namespace absenc::client
