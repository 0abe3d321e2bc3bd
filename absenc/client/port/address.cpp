// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/address.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/client/port/joint_settings.hpp"
#include "absenc/client/port/named_encoder.hpp"
#include "absenc/client/port/setting_value.hpp"
#include "absenc/client/port/settings_file.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/realtime.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/socketcan.hpp"
#include "absenc/os/spi_port.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

namespace {

// `what` is the part of the setting's name after that of the wire: "" sets the wire itself, "_us" the width of the
// pulse, "_active" its level.
void set_pulse_wire(os::PulseWire& wire, std::string_view what, const OptionText& setting) {
  using Kind = os::PulseWire::Kind;
  constexpr std::string_view gpio = "gpio:";
  if (what == "_us") {
    wire.width = std::chrono::microseconds(number_of(setting, 1, 10'000'000));
  } else if (what == "_active") {
    wire.active_high = choice_of(setting, {"low", "high"}) == 1;
  } else if (setting.value.starts_with(gpio) && setting.value.size() > gpio.size()) {
    wire.kind = Kind::gpio;
    wire.name = setting.value.substr(gpio.size());
  } else if (setting.value == "rts" || setting.value == "dtr") {
    wire.kind = setting.value == "rts" ? Kind::rts : Kind::dtr;
  } else {
    throw UsageError(fmt::format("{} is \"{}\", but must be rts, dtr or gpio:NAME, as `gpioinfo` lists it",
                                 setting.name, setting.value));
  }
}

const Command& reading_command(const Unit& unit, std::string_view name) {
  const Command& command = require_command(unit, name);
  if (command.changes_encoder || !command.arguments.empty()) {
    throw UsageError(
        fmt::format("command is \"{}\", which {}: only a command that reads a position can be read again and "
                    "again",
                    name, command.changes_encoder ? "changes the encoder" : "takes arguments"));
  }
  return command;
}

void set_link_parameter(EncoderAddress& uri, const OptionText& setting) {
  if (set_joint(uri.joint, setting)) return;
  const std::string value(setting.value);
  constexpr std::string_view trigger = "trigger";
  constexpr std::string_view clear = "clear";
  if (setting.name.starts_with(trigger)) {
    return set_pulse_wire(uri.wires.trigger, setting.name.substr(trigger.size()), setting);
  }
  if (setting.name.starts_with(clear)) {
    return set_pulse_wire(uri.wires.clear, setting.name.substr(clear.size()), setting);
  }
  if (setting.name == rate_setting) {
    std::uint32_t& rate = uri.port_kind == PortKind::slcan ? uri.adapter_rate : uri.line.rate;
    rate = static_cast<std::uint32_t>(number_of(setting, 1, 100'000'000));
  } else if (setting.name == "log") {
    if (uri.unit->link != LinkKind::can) throw UsageError("log cannot be set here: it takes down frames of a CAN bus");
    uri.log = value;
  } else if (setting.name == "parity") {
    constexpr std::array parities{Parity::none, Parity::odd, Parity::even};
    uri.line.parity = parities[choice_of(setting, {"none", "odd", "even"})];
  } else if (setting.name == "rs485") {
    uri.rs485 = static_cast<os::Rs485>(choice_of(setting, os::rs485_names));
  } else if (setting.name == "latency") {
    uri.latency = std::chrono::milliseconds(number_of(setting, 0, 60'000));
  } else if (setting.name == "speed") {
    uri.spi.speed = static_cast<std::uint32_t>(number_of(setting, 1, 1'000'000'000));
    if (uri.line.highest_rate != 0 && uri.spi.speed > uri.line.highest_rate) {
      throw UsageError(fmt::format("speed is {} Hz, but {} allows {} Hz at most", *uri.spi.speed, uri.unit->document,
                                   uri.line.highest_rate));
    }
  } else if (setting.name == "spi_mode") {
    uri.spi.mode = static_cast<std::uint8_t>(number_of(setting, 0, 3));
  } else if (setting.name == "echo") {
    constexpr std::array modes{host::EchoMode::automatic, host::EchoMode::on, host::EchoMode::off};
    uri.echo = modes[choice_of(setting, {"auto", "on", "off"})];
  } else if (setting.name == "max_rpm") {
    uri.maximum_rpm = static_cast<std::uint32_t>(number_of(setting, 1, 1'000'000));
  } else if (setting.name == "max_mm_s") {
    uri.maximum_mm_s = static_cast<std::uint32_t>(number_of(setting, 1, 1'000'000));
  } else if (setting.name == "realtime") {
    uri.realtime = static_cast<int>(number_of(setting, os::lowest_realtime, os::highest_realtime));
  } else if (setting.name == "command") {
    uri.reads = &reading_command(*uri.unit, setting.value);
  } else if (setting.name == "motion") {
    uri.device.motion = value;
  } else if (setting.name == "singleturn") {
    uri.device.singleturn = number_of(setting, 0, INT64_MAX);
  } else if (setting.name == "multiturn") {
    uri.device.multiturn = number_of(setting, INT64_MIN, INT64_MAX);
  } else if (setting.name == "condition") {
    uri.device.conditions.push_back(value);
  } else if (setting.name == "alarm") {
    uri.device.alarms.push_back(value);
  } else if (setting.name == "fault") {
    uri.device.faults.push_back(value);
  } else if (setting.name == "seed") {
    uri.device.seed = static_cast<std::uint64_t>(number_of(setting, 0, INT64_MAX));
  }
}

bool allowed(const LinkParameter& parameter, PortKind place) {
  constexpr std::string_view separator = ", ";
  const std::string_view name = port_kind_names[static_cast<std::size_t>(place)];
  for (std::string_view rest = parameter.port_kinds;;) {
    const std::size_t end = rest.find(separator);
    if (rest.substr(0, end) == name) return true;
    if (end == std::string_view::npos) return false;
    rest.remove_prefix(end + separator.size());
  }
}

// Refuses a speed limit of the wrong kind (rpm or mm/s), which would be ignored.
void check_speed_limit(const EncoderAddress& uri) {
  const bool linear = uri.unit->resolution(uri.options).unit_um > 0;
  if (linear && uri.maximum_rpm != 0) {
    throw UsageError("max_rpm cannot be set here, because the encoder is a linear one: set max_mm_s=MM/S");
  }
  if (!linear && uri.maximum_mm_s != 0) {
    throw UsageError("max_mm_s cannot be set here, because it is for linear encoders: set max_rpm=RPM");
  }
}

// Applies the options before the other settings, because the defaults of the line follow from them.
void take_settings(EncoderAddress& uri, std::span<const OptionText> settings) {
  std::vector<OptionText> options;
  std::vector<OptionText> of_link;
  for (const OptionText& setting : settings) {
    const LinkParameter* parameter = find_link_parameter(setting.name);
    const Option* option = find_option(*uri.unit, setting.name);
    if (parameter == nullptr || option != nullptr) {
      options.push_back({option != nullptr ? option->name : setting.name, setting.value});
    } else if (allowed(*parameter, uri.port_kind)) {
      of_link.push_back(setting);
    } else {
      throw UsageError(fmt::format("{} cannot be set here, it is for: {}", setting.name, parameter->port_kinds));
    }
  }
  std::vector<std::string_view> names;
  for (const LinkParameter& parameter : link_parameters) {
    if (allowed(parameter, uri.port_kind)) names.push_back(parameter.name);
  }
  uri.options = require_options(*uri.unit, {}, options, names);
  uri.line = line_settings(*uri.unit, uri.options);
  for (const OptionText& setting : of_link) {
    set_link_parameter(uri, setting);
    uri.link_settings.push_back(fmt::format("{}={}", setting.name, setting.value));
  }
  check_speed_limit(uri);
  check_joint(of_link, uri.unit->resolution(uri.options).unit_um > 0);
  const bool any_rate_does =
      uri.port_kind == PortKind::sim || (uri.port_kind == PortKind::serial && os::is_pseudo_terminal(uri.path));
  if (any_rate_does) uri.line = uri.line.with_some_rate();
}

bool goes_over_serial(const Unit& unit) {
  return unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
}

std::string examples(const Unit& unit) {
  const auto first = [](const std::vector<std::string>& ports, const std::string& otherwise) {
    return ports.empty() ? otherwise : ports.front();
  };
  if (goes_over_serial(unit)) {
    return fmt::format("{0}:{1}, {0}:tcp:HOST:PORT or sim:{0}", unit.id, first(os::serial_ports(), os::example_port()));
  }
  if (unit.link == LinkKind::can) {
    return fmt::format("{0}:{1}, {0}:slcan:/dev/ttyACM0 or sim:{0}", unit.id, first(os::can_interfaces(), "can0"));
  }
  if (unit.link == LinkKind::clocked_bidirectional) return fmt::format("{0}:ftdi or sim:{0}", unit.id);
  const std::string clocks = unit.link == LinkKind::clocked ? fmt::format("{}:ftdi, ", unit.id) : "";
  return fmt::format("{2}{0}:spi:{1} or sim:{0}", unit.id, first(os::spi_devices(), "/dev/spidev0.0"), clocks);
}

// Returns whether a port of this kind can carry the unit's kind of line, and what the port is in words.
std::pair<bool, std::string_view> carries(PortKind place, const Unit& unit) {
  switch (place) {
    case PortKind::can:
    case PortKind::slcan:
      return {unit.link == LinkKind::can, "a CAN adapter"};
    case PortKind::spi:  // an SPI controller of Linux cannot switch its data line between sending and receiving
      return {host_clocks(unit.link) && unit.link != LinkKind::clocked_bidirectional, "an SPI controller"};
    case PortKind::ftdi:
      return {host_clocks(unit.link), "the clock of an FTDI chip"};
    case PortKind::tcp:
      return {goes_over_serial(unit), "TCP"};
    case PortKind::serial:
    case PortKind::sim:
      break;
  }
  return {goes_over_serial(unit), "a serial port"};
}

// Checks that the port can carry the unit's kind of line. Throws UsageError if not.
void check_place(const EncoderAddress& uri, std::string_view address) {
  const auto [fits, place] = carries(uri.port_kind, *uri.unit);
  if (fits) return;
  throw UsageError(fmt::format("\"{}\": {} ({}) does not go over {}: write {}", address, uri.unit->id,
                               line_of(*uri.unit), place, examples(*uri.unit)));
}

void parse_tcp(EncoderAddress& uri, std::string_view where) {
  const std::size_t colon = where.rfind(':');
  const std::string_view host = where.substr(0, colon);
  // The last colon precedes the port number; further colons belong to an IPv6 address.
  const bool bare_ipv6 = !host.starts_with('[') && host.find(':') != std::string_view::npos;
  if (colon == std::string_view::npos || host.empty() || bare_ipv6 || (host.starts_with('[') && !host.ends_with(']'))) {
    throw UsageError(
        fmt::format("\"tcp:{}\" is no TCP address: write tcp:HOST:PORT, an IPv6 address in brackets, as "
                    "in tcp:[::1]:4001",
                    where));
  }
  uri.host = host;
  uri.port = static_cast<std::uint16_t>(number_of({"the TCP port", where.substr(colon + 1)}, 1, 65535));
}

void parse_where(EncoderAddress& uri, std::string_view address) {
  const std::size_t colon = address.find(':');
  const std::string_view unit = address.substr(0, colon);
  if (const std::optional<std::string> port = bare_port(address)) {
    throw UsageError(
        fmt::format("\"{0}\" does not say which protocol: `absenc identify {1}` finds it out; if you know "
                    "it, write it before the port, as in tformat:{1}",
                    address, *port));
  }
  if (unit == "sim") {
    if (colon == std::string_view::npos || colon + 1 == address.size()) {
      throw UsageError(fmt::format("\"{}\" does not say which encoder: write sim:{}", address, all_units()[0]->id));
    }
    uri.port_kind = PortKind::sim;
    uri.unit = &require_unit(address.substr(colon + 1));
    return;
  }
  uri.unit = &require_unit(unit);
  if (colon == std::string_view::npos || colon + 1 == address.size()) {
    throw UsageError(fmt::format("\"{}\" does not say where the encoder is: write {}", address, examples(*uri.unit)));
  }
  const std::string_view where = address.substr(colon + 1);
  if (where.starts_with("tcp:")) {
    uri.port_kind = PortKind::tcp;
  } else if (where.starts_with("spi:")) {
    uri.port_kind = PortKind::spi;
    if (uri.unit->over_spi != nullptr) uri.unit = uri.unit->over_spi;
  } else if (is_ftdi_place(where)) {
    uri.port_kind = PortKind::ftdi;
    if (uri.unit->over_spi != nullptr) uri.unit = uri.unit->over_spi;
  } else if (where.starts_with("slcan:")) {
    uri.port_kind = PortKind::slcan;
  } else if (uri.unit->link == LinkKind::can && !os::is_written_as_port(where)) {
    uri.port_kind = PortKind::can;
  }
  check_place(uri, address);
  if (uri.port_kind == PortKind::tcp) return parse_tcp(uri, where.substr(4));
  if (uri.port_kind == PortKind::ftdi) {
    const std::string_view behind = where.substr(ftdi_name.size());
    uri.path = behind.starts_with(':') ? behind.substr(1) : behind;
    return;
  }
  uri.path =
      uri.port_kind == PortKind::spi || uri.port_kind == PortKind::slcan ? where.substr(where.find(':') + 1) : where;
  if (uri.path.empty()) {
    const std::string_view what = uri.port_kind == PortKind::spi ? "SPI device" : "serial port of the adapter";
    throw UsageError(fmt::format("\"{}\" does not say which {}: write {}", address, what, examples(*uri.unit)));
  }
}

EncoderAddress parse_place(std::string_view address) {
  EncoderAddress uri;
  parse_where(uri, address);
  uri.line = uri.unit->line;
  const bool half_duplex = uri.unit->link == LinkKind::half_duplex;
  if (half_duplex) uri.echo = host::EchoMode::automatic;
  if (!half_duplex) uri.rs485 = os::Rs485::off;
  return uri;
}

bool is_name(std::string_view address) {
  return !address.empty() && address.find_first_of(":/") == std::string_view::npos && address != "sim" &&
         find_unit(address) == nullptr;
}

// A name in absenc.toml has priority over a port of the same name.
bool is_in_settings_file(std::string_view name) {
  const std::optional<SettingsFile> file = load_settings_file();
  return file && std::any_of(file->encoders.begin(), file->encoders.end(),
                             [&](const FileSection& encoder) { return encoder.name == name; });
}

bool fits(const EncoderAddress& uri, std::string_view setting) {
  if (find_option(*uri.unit, setting) != nullptr) return true;
  if (const LinkParameter* parameter = find_link_parameter(setting)) return allowed(*parameter, uri.port_kind);
  return setting == word_option_name && takes_word(*uri.unit);
}

void require_once(std::span<const OptionText> settings) {
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const std::string_view name = settings[i].name;
    const LinkParameter* parameter = find_link_parameter(name);
    if (parameter != nullptr && parameter->repeatable) continue;
    const auto before = settings.first(i);
    const auto* const other =
        std::find_if(before.data(), before.data() + before.size(), [&](const auto& one) { return one.name == name; });
    if (other == before.data() + before.size()) continue;
    throw UsageError(fmt::format("{} is given twice, as \"{}\" and as \"{}\": which is meant?", name, other->value,
                                 settings[i].value));
  }
}

// Checks the last one of `settings`; the settings before it were checked by earlier calls.
void try_settings(EncoderAddress uri, std::span<const OptionText> settings) {
  take_settings(uri, settings);
  const bool options_are_set = find_link_parameter(settings.back().name) != nullptr;
  if (uri.port_kind == PortKind::sim && options_are_set) VirtualDevice(*uri.unit, uri.options, uri.device);
}

EncoderAddress parse_named(std::string_view name, std::span<const OptionText> written, const NamedEncoders& names) {
  NamedEncoder named = names.require(name);
  EncoderAddress uri = at(named.place, [&] { return parse_place(named.address); });

  std::vector<FileSetting> settings = std::move(named.settings);
  std::copy_if(named.defaults.begin(), named.defaults.end(), std::back_inserter(settings),
               [&](const FileSetting& setting) { return fits(uri, setting.name); });
  // Applies options first, because the settings of a virtual encoder depend on its options.
  std::stable_partition(settings.begin(), settings.end(),
                        [](const FileSetting& setting) { return find_link_parameter(setting.name) == nullptr; });
  std::vector<OptionText> all;
  for (const FileSetting& setting : settings) {
    for (const std::string& value : setting.values) all.push_back({setting.name, value});
    if (!setting.values.empty()) at(setting.place, [&] { try_settings(uri, all); });
  }
  std::erase_if(all, [&](const OptionText& setting) {
    return std::any_of(written.begin(), written.end(), [&](const auto& over) { return over.name == setting.name; });
  });
  all.insert(all.end(), written.begin(), written.end());
  take_settings(uri, all);
  if (named.has_company) tell_shared(*uri.unit, uri.options);
  return uri;
}

}  // namespace

const Option* find_option(const Unit& unit, std::string_view name) {
  for (const Option& option : unit.options) {
    if (option.name == name) return &option;
  }
  return name == rate_setting && goes_over_serial(unit) ? find_role(unit.options, Role::rate) : nullptr;
}

const LinkParameter* find_link_parameter(std::string_view name) {
  const auto found = std::find_if(link_parameters.begin(), link_parameters.end(),
                                  [&](const LinkParameter& one) { return one.name == name; });
  return found == link_parameters.end() ? nullptr : &*found;
}

std::optional<std::string> bare_port(std::string_view text) {
  const std::string_view address = text.substr(0, text.find('?'));
  const std::string_view first = address.substr(0, address.find(':'));
  const bool is_place =
      os::is_written_as_port(first) || first == "tcp" || first == "spi" || first == "slcan" || is_ftdi_place(address);
  if (is_place) return std::string(text);
  if (!is_name(address)) return std::nullopt;
  const auto is_one_of = [](const std::vector<std::string>& ports, std::string_view name) {
    return std::find(ports.begin(), ports.end(), name) != ports.end();
  };
  const std::string serial = os::port_named(address);
  const bool is_port = !serial.empty() || is_one_of(os::can_interfaces(), address);
  if (!is_port || is_in_settings_file(address)) return std::nullopt;
  return (serial.empty() ? std::string(address) : serial) + std::string(text.substr(address.size()));
}

EncoderAddress parse_address(std::string_view text, std::span<const std::string> more) {
  const std::size_t question = std::min(text.find('?'), text.size());
  const std::string_view address = text.substr(0, question);
  std::vector<OptionText> settings;
  std::string_view rest = text.substr(std::min(question + 1, text.size()));
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    settings.push_back(split_setting(rest.substr(0, end)));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  for (const std::string& setting : more) settings.push_back(split_setting(setting));
  require_once(settings);
  std::string written(address);
  for (const OptionText& one : settings) {
    written += fmt::format("{}{}={}", written.size() == address.size() ? '?' : '&', one.name, one.value);
  }
  if (is_name(address) && !bare_port(address)) {
    EncoderAddress uri = parse_named(address, settings,
                                     require_names(fmt::format("\"{}\" is no PROTOCOL:PORT, so it would have to be "
                                                               "a name of absenc.toml",
                                                               address)));
    uri.written = std::move(written);
    return uri;
  }
  EncoderAddress uri = parse_place(address);
  take_settings(uri, settings);
  uri.written = std::move(written);
  return uri;
}

EncoderAddress parse_address(std::string_view name, const NamedEncoders& names) {
  EncoderAddress uri = parse_named(name, {}, names);
  uri.written = name;
  return uri;
}

bool is_ftdi_place(std::string_view text) {
  if (!text.starts_with(ftdi_name)) return false;
  const std::string_view behind = text.substr(ftdi_name.size());
  return behind.empty() || behind.starts_with(':') || behind.starts_with('/');
}

std::string ftdi_place(std::string_view path) {
  return fmt::format("{}{}{}", ftdi_name, path.empty() || path.starts_with('/') ? "" : ":", path);
}

host::SpeedLimit speed_limit(const EncoderAddress& uri) {
  host::SpeedLimit limit = host::speed_limit(uri.options);
  if (uri.maximum_rpm != 0) limit.rpm = uri.maximum_rpm;
  if (uri.maximum_mm_s != 0) limit.mm_s = uri.maximum_mm_s;
  return limit;
}

std::string shell_text(std::string_view address) {
  return address.find('?') == std::string_view::npos ? std::string(address) : fmt::format("\"{}\"", address);
}

std::string address_of(const EncoderAddress& uri) {
  if (uri.port_kind == PortKind::sim) return fmt::format("sim:{}", uri.unit->id);
  if (uri.port_kind == PortKind::spi) return fmt::format("{}:spi:{}", uri.unit->id, uri.path);
  if (uri.port_kind == PortKind::ftdi) return fmt::format("{}:{}", uri.unit->id, ftdi_place(uri.path));
  if (uri.port_kind == PortKind::tcp) return fmt::format("{}:tcp:{}:{}", uri.unit->id, uri.host, uri.port);
  if (uri.port_kind == PortKind::slcan) return fmt::format("{}:slcan:{}", uri.unit->id, uri.path);
  return fmt::format("{}:{}", uri.unit->id, uri.path);
}

}  // namespace absenc::client
