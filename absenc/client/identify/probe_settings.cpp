// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/identify/probe_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

Medium medium_of(const LineSearch& search) {
  const std::string& place = search.place;
  if (place.starts_with("spi:")) return Medium::spi;
  if (is_ftdi_place(place)) return Medium::ftdi;
  if (place.starts_with("tcp:")) return Medium::tcp;
  // A place that is not written as a serial port is the name of a CAN interface.
  return place.starts_with("slcan:") || !os::is_written_as_port(place) ? Medium::can : Medium::serial;
}

bool fits(const Unit& unit, const LineSearch& search) {
  if (unit.line.data_bits > search.most_data_bits) return false;
  const Medium way = medium_of(search);
  if (way == Medium::can) return unit.link == LinkKind::can;
  if (way == Medium::spi) return host_clocks(unit.link) && unit.link != LinkKind::clocked_bidirectional;
  if (way == Medium::ftdi)
    return carries_bits(unit.link) || (unit.link == LinkKind::spi && unit.line.spi_mode % 2 == 0);
  // A pseudo-terminal carries any bytes, but no UART has characters of more than 8 bits.
  if (way == Medium::serial && unit.line.data_bits > 8 && !os::is_pseudo_terminal(search.place)) return false;
  return unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
}

bool can_receive(const Unit& unit, std::uint32_t rate, const LineSearch& search) {
  const bool any_rate = unit.line.rate == 0 || find_role(unit.options, Role::rate) != nullptr;
  const bool users_rate = has_setting(search.settings, rate_setting);
  return any_rate || users_rate || medium_of(search) == Medium::tcp || unit.line.rate == rate;
}

bool has_setting(const SettingTexts& settings, std::string_view name) {
  return std::any_of(settings.begin(), settings.end(),
                     [&](const std::string& one) { return split_setting(one).name == name; });
}

std::vector<OptionText> option_settings(const Unit& unit, const SettingTexts& settings, bool with_model) {
  std::vector<OptionText> options;
  for (const std::string& setting : settings) {
    const OptionText one = split_setting(setting);
    if (const Option* option = find_option(unit, one.name)) {
      options.push_back({option->name, one.value});
    } else if (with_model && one.name == "model") {
      options.push_back(one);
    }
  }
  return options;
}

std::vector<std::uint8_t> request_of(const Unit& unit, const Options& options, const Command& command) {
  std::vector<std::int64_t> arguments;
  for (const Argument& argument : command.arguments) arguments.push_back(argument.default_value);
  std::array<std::uint8_t, 256> bytes{};
  const Result<std::size_t> size = unit.encode(options, command, arguments, bytes);
  if (!size) return {};
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(*size)};
}

std::vector<SettingTexts> settings_to_try(const Unit& unit, const SettingTexts& settings, const Command& read) {
  constexpr std::size_t most_ways = 8;
  std::vector<SettingTexts> all;
  std::vector<std::vector<std::uint8_t>> requests;
  const Command* scan = find_command(unit, Verb::scan);
  const auto add = [&](const SettingTexts& way) {
    SettingTexts together = settings;
    together.insert(together.end(), way.begin(), way.end());
    const Options options = require_options(unit, {}, option_settings(unit, together, true));
    if (all.size() >= most_ways || (unit.streams != nullptr && unit.streams(options))) return;
    std::vector<std::uint8_t> request = request_of(unit, options, read);
    if (scan != nullptr) {
      const std::vector<std::uint8_t> scanning = request_of(unit, options, *scan);
      request.insert(request.end(), scanning.begin(), scanning.end());
    }
    const bool known = std::find(requests.begin(), requests.end(), request) != requests.end();
    if (known && unit.link != LinkKind::clocked) return;
    requests.push_back(std::move(request));
    all.push_back(way);
  };
  add({});
  for (const Model& model : unit.models) add({fmt::format("model={}", model.name)});
  for (const Option& option : unit.options) {
    if (unit.link == LinkKind::clocked || option.role == Role::rate || has_setting(settings, option.name)) continue;
    for (const std::string_view choice : option.choices) add({fmt::format("{}={}", option.name, choice)});
  }
  return all;
}

std::vector<std::vector<std::uint8_t>> harmful_to_others(const Unit& unit, std::uint32_t rate,
                                                         const LineSearch& search) {
  std::vector<std::vector<std::uint8_t>> all;
  for (const Unit* other : all_units()) {
    if (other == &unit || !fits(*other, search) || !can_receive(*other, rate, search)) continue;
    // An encoder that expects characters of another length cannot understand requests of `unit`.
    if (other->line.data_bits != unit.line.data_bits) continue;
    Options defaults;
    for (std::size_t i = 0; i < other->options.size(); ++i) defaults.values[i] = other->options[i].default_value;
    for (const Command& command : other->commands) {
      if (!command.changes_encoder) continue;
      std::vector<std::uint8_t> request = request_of(*other, defaults, command);
      if (!request.empty()) all.push_back(std::move(request));
    }
  }
  return all;
}

}  // namespace absenc::client
