// SPDX-License-Identifier: Apache-2.0
// An encoder as the user writes it: tformat:/dev/ttyUSB0?model=23-bit&echo=on, tformat:tcp:host:4001,
// ssi:spi:/dev/spidev0.0, raa38-can:can0, raa38-can:slcan:/dev/ttyACM0, sim:tformat, or a name of absenc.toml.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "absenc/host/echo.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/spi_port.hpp"
#include "absenc/protocol/unit.hpp"
#include "tools/absenc/virtual_device.hpp"

namespace absenc::tool {

enum class Place : std::uint8_t { serial, tcp, spi, can, slcan, sim };

/// A setting of the way to the encoder, beside the options of its protocol.
struct LinkParameter {
  std::string_view name;
  std::string_view value;
  std::string_view meaning;
  std::string_view places;     // for people
  bool serial, tcp, spi, sim;  // where it may be given
  bool repeatable = false;
  bool can = false, slcan = false;
};

inline constexpr std::array<LinkParameter, 20> link_parameters{{
    {"baud", "RATE", "bits a second, instead of the protocol's own; slcan: of the adapter's port, 115200",
     "serial, slcan", true, false, false, false, false, false, true},
    {"parity", "none|odd|even", "of each character, instead of the protocol's own", "serial, sim", true, false, false,
     true},
    {"trigger", "rts|dtr|gpio:NAME", "the wire whose pulse asks for a frame", "serial", true, false, false, false},
    {"trigger_us", "US", "how long that pulse lasts, instead of the protocol's own", "serial", true, false, false,
     false},
    {"trigger_active", "low|high", "its level at the UART's pin or the GPIO line, low if not said", "serial", true,
     false, false, false},
    {"clear", "rts|dtr|gpio:NAME", "the wire whose pulse sets the zero", "serial", true, false, false, false},
    {"clear_us", "US", "how long that pulse lasts, instead of the protocol's own", "serial", true, false, false, false},
    {"clear_active", "low|high", "its level at the UART's pin or the GPIO line, low if not said", "serial", true, false,
     false, false},
    {"rs485", "auto|on|off", "whether the kernel switches the direction of the transceiver", "serial", true, false,
     false, false},
    {"latency", "MS", "what the way adds to the encoder's answer time", "serial, tcp, can, slcan", true, true, false,
     false, false, true, true},
    {"log", "FILE", "write every CAN frame sent and received to it, as candump -l does; it must not exist yet",
     "can, slcan, sim", false, false, false, true, false, true, true},
    {"speed", "HZ", "clock of the controller, instead of the protocol's own", "spi", false, false, true, false},
    {"spi_mode", "0..3", "2 x CPOL + CPHA, instead of the protocol's own", "spi", false, false, true, false},
    {"echo", "auto|on|off", "whether the adapter sends back what is sent", "serial, tcp, sim", true, true, false, true},
    {"motion", "MOTION", "still, rpm=R, sine=DEGREES,HZ or file=CSV", "sim", false, false, false, true},
    {"singleturn", "COUNTS", "position within the turn at the start", "sim", false, false, false, true},
    {"multiturn", "TURNS", "turns at the start", "sim", false, false, false, true},
    {"alarm", "NAME", "an alarm to raise; may be given more than once", "sim", false, false, false, true, true},
    {"fault", "KIND=RATE", "a fault to inject, with its probability; may be given more than once", "sim", false, false,
     false, true, true},
    {"seed", "N", "another series of faults", "sim", false, false, false, true},
}};

/// Null when there is none with this name.
[[nodiscard]] const LinkParameter* find_link_parameter(std::string_view name);

struct EncoderUri {
  const Unit* unit = nullptr;
  Options options;
  Place place = Place::serial;
  std::string path;  // serial, spi, slcan; can: the interface
  std::string host;  // tcp
  std::uint16_t port = 0;

  LineSettings line;
  os::Rs485 rs485 = os::Rs485::automatic;
  os::PulseWires wires;
  std::optional<Time> latency;
  os::SpiChoice spi;
  std::uint32_t adapter_rate = 115'200;  // slcan: of the serial port, not of the bus
  std::string log;                       // "": none
  host::EchoMode echo = host::EchoMode::off;
  DeviceSettings device;
};

/// `settings` ("name=value") count as if they stood behind the text; both override what absenc.toml says of a name.
/// Throws UsageError, which names what is wrong and the nearest name that would be right.
[[nodiscard]] EncoderUri parse_encoder(std::string_view text, std::span<const std::string> settings = {});

/// Without its settings: "tformat:/dev/ttyUSB0"
[[nodiscard]] std::string address_of(const EncoderUri& uri);

}  // namespace absenc::tool
