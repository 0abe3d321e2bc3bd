// SPDX-License-Identifier: Apache-2.0
// Parses the address of an encoder, as tformat:/dev/ttyUSB0?model=23-bit.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/joint.hpp"
#include "absenc/client/port/virtual_device.hpp"
#include "absenc/host/echo.hpp"
#include "absenc/host/speed_limit.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/spi_choice.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

enum class PortKind : std::uint8_t { serial, tcp, spi, ftdi, can, slcan, sim };
inline constexpr std::array<std::string_view, 7> port_kind_names{"serial", "tcp", "spi", "ftdi", "can", "slcan", "sim"};

/// Name of the setting for the rate of an asynchronous line.
inline constexpr std::string_view rate_setting = "baud";

/// A setting of an address that is no option of the protocol.
struct LinkParameter {
  std::string_view name;
  std::string_view value;
  std::string_view meaning;
  std::string_view port_kinds;  // kinds of ports to which the setting applies, as names of `port_kind_names`
  bool repeatable = false;
};

inline constexpr std::array<LinkParameter, 31> link_parameters{{
    {rate_setting, "RATE", "bits a second, instead of the protocol's own; slcan: of the adapter's port, 115200",
     "serial, slcan"},
    {"parity", "none|odd|even", "of each character, instead of the protocol's own", "serial, sim"},
    {"trigger", "rts|dtr|gpio:NAME", "the wire whose pulse asks for a frame", "serial"},
    {"trigger_us", "US", "how long that pulse lasts, instead of the protocol's own", "serial"},
    {"trigger_active", "low|high", "its level at the UART's pin or the GPIO line, low if not said", "serial"},
    {"clear", "rts|dtr|gpio:NAME", "the wire whose pulse sets the zero", "serial"},
    {"clear_us", "US", "how long that pulse lasts, instead of the protocol's own", "serial"},
    {"clear_active", "low|high", "its level at the UART's pin or the GPIO line, low if not said", "serial"},
    {"rs485", "auto|on|off|rts",
     "who switches the direction of the transceiver: the kernel, or with rts absenc, which sets RTS while it sends",
     "serial"},
    {"latency", "MS", "what the way adds to the encoder's answer time", "serial, tcp, can, slcan"},
    {"log", "FILE", "write every CAN frame sent and received to it, as candump -l does; it must not exist yet",
     "can, slcan, sim"},
    {"speed", "HZ", "clock of the controller, instead of the protocol's own", "spi, ftdi"},
    {"spi_mode", "0..3", "2 x CPOL + CPHA, instead of the protocol's own", "spi, ftdi"},
    {"echo", "auto|on|off", "whether the adapter sends back what is sent", "serial, tcp, sim"},
    {"max_rpm", "RPM",
     "the fastest that the shaft turns: farther than it gets no position is believed, nor turns after "
     "too long a pause",
     "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"max_mm_s", "MM/S", "the same of a linear encoder", "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"direction", "1|-1", "-1: the joint turns against the encoder; shown as joint angle beside the encoder's own",
     "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"offset_deg", "DEG", "degrees at the encoder where the joint is at 0", "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"offset_mm", "MM", "the same of a linear encoder", "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"gear", "RATIO", "turns of the encoder for one of the joint: 100, 50/3",
     "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"pole_pairs", "N", "of the motor on the encoder's shaft, for its electrical angle",
     "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"pole_pair_mm", "MM", "length of a pole pair of a linear motor, for its electrical angle",
     "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"command", "NAME", "what is read, instead of the position with all alarms: a command that yields positions",
     "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"realtime", "PRIORITY",
     "use the port in real-time threads (SCHED_FIFO) of this priority, 1 to 99, with the memory of the program locked; "
     "an error if the kernel refuses",
     "serial, tcp, spi, ftdi, can, slcan, sim"},
    {"motion", "MOTION", "still, rpm=R, sine=DEGREES,HZ or file=CSV", "sim"},
    {"singleturn", "COUNTS", "position within the turn at the start", "sim"},
    {"multiturn", "TURNS", "turns at the start", "sim"},
    {"condition", "NAME=VALUE",
     "a condition of the virtual encoder: temperature, battery ...; may be given more than once", "sim", true},
    {"alarm", "NAME", "an alarm to raise; may be given more than once", "sim", true},
    {"fault", "KIND=RATE",
     "a fault to inject, with its probability for each reply (request_corrupt: for each byte heard); may be given more "
     "than once",
     "sim", true},
    {"seed", "N", "another series of faults", "sim"},
}};

/// Returns the option of the unit that a setting of this name sets; null if the name is that of no option.
[[nodiscard]] const Option* find_option(const Unit& unit, std::string_view name);

/// Returns the description of the port or line setting with this name; null if there is no such setting.
[[nodiscard]] const LinkParameter* find_link_parameter(std::string_view name);

struct EncoderAddress {
  const Unit* unit = nullptr;
  Options options;
  PortKind port_kind = PortKind::serial;
  // path of the port for serial, spi, slcan; name of the interface for can; "SERIAL/B" for ftdi, "" for the only
  // adapter
  std::string path;
  std::string host;  // name or address of the host; only for tcp
  std::uint16_t port = 0;

  LineSettings line;
  os::Rs485 rs485 = os::Rs485::automatic;
  os::PulseWires wires;
  std::optional<Time> latency;
  os::SpiChoice spi;
  std::uint32_t adapter_rate = 115'200;  // only for slcan: rate of the serial port in bits per second, not of the bus
  std::string log;                       // path of the CAN log file; "": no log
  host::EchoMode echo = host::EchoMode::off;
  std::uint32_t maximum_rpm = 0;   // speed limit of the shaft in rpm; 0: that of the model, or the default
  std::uint32_t maximum_mm_s = 0;  // speed limit of a linear encoder in mm/s; 0: the default
  Joint joint;                     // how the encoder is mounted in its drive
  int realtime = 0;                // real-time priority, 1 to 99, of threads that use the port; 0: none
  const Command* reads = nullptr;  // command for repeated readings; null: the first command with Verb::read
  DeviceSettings device;
  std::string written;  // address as the user wrote it, with the settings given beside it: "elbow?baud=57600"
  // settings of port and line that were given, also in absenc.toml, as "baud=57600"
  std::vector<std::string> link_settings;
};

/// Returns the speed limit that the user set or, if none was set, that of host::speed_limit.
[[nodiscard]] host::SpeedLimit speed_limit(const EncoderAddress& uri);

/// Returns the port if `text` is the address of a port without a protocol, as "/dev/ttyUSB0"; otherwise nothing.
[[nodiscard]] std::optional<std::string> bare_port(std::string_view text);

/// Beginning of the name of an FTDI chip as a port: "ftdi", "ftdi:SERIAL", "ftdi:SERIAL/B", "ftdi/B".
inline constexpr std::string_view ftdi_name = "ftdi";
[[nodiscard]] bool is_ftdi_place(std::string_view text);
/// Returns the name of an FTDI chip as a port, as "ftdi:SERIAL/B", for the EncoderAddress::path `path`, as "SERIAL/B".
[[nodiscard]] std::string ftdi_place(std::string_view path);

/// Parses an address and further `settings` ("name=value"). Throws UsageError.
[[nodiscard]] EncoderAddress parse_address(std::string_view text, std::span<const std::string> settings = {});

class NamedEncoders;
/// Returns the address that absenc.toml gives to the encoder of this name; `names` is the content of absenc.toml.
[[nodiscard]] EncoderAddress parse_address(std::string_view name, const NamedEncoders& names);

/// Returns an address for a command that a shell executes: in quotes if it has settings, for their ? and &.
[[nodiscard]] std::string shell_text(std::string_view address);

/// Returns protocol and port of the address, without settings: "tformat:/dev/ttyUSB0".
[[nodiscard]] std::string address_of(const EncoderAddress& uri);

}  // namespace absenc::client
