// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/named_encoder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "absenc/client/port/address.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/real_number.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

namespace {

using Names = std::vector<std::string_view>;

// name of the setting for the readings per second of `serve`
constexpr std::string_view rate_name = "rate_hz";

void add_options(Names& names, const Unit& unit) {
  for (const Option& option : unit.options) names.push_back(option.name);
  if (takes_word(unit)) names.push_back(word_option_name);
}

void add_link_parameters(Names& names) {
  for (const LinkParameter& parameter : link_parameters) names.push_back(parameter.name);
}

void refuse(const std::string& place, const std::string& sentence) {
  throw UsageError(fmt::format("{}: {}", place, sentence));
}

void check_settings(const FileSection& section, const Names& known, std::string_view what) {
  for (const FileSetting& setting : section.settings) {
    if (std::find(known.begin(), known.end(), setting.name) == known.end()) {
      refuse(setting.place,
             fmt::format("{} has no setting \"{}\"{}", what, setting.name, suggestion(setting.name, known)));
    }
    const LinkParameter* parameter = find_link_parameter(setting.name);
    if (setting.is_list && (parameter == nullptr || !parameter->repeatable)) {
      refuse(setting.place, fmt::format("{} is a list, but must be one value", setting.name));
    }
  }
}

void check_defaults(const FileSection& defaults) {
  Names known;
  add_link_parameters(known);
  for (const Unit* unit : all_units()) add_options(known, *unit);
  check_settings(defaults, known, "[defaults]");
}

void check_bus(const FileSection& bus) {
  Names known{"port"};
  add_link_parameters(known);
  check_settings(bus, known, "a bus");
  if (bus.find("port") == nullptr) refuse(bus.place, fmt::format("the bus {} has no port", bus.name));
}

void check_name(const FileSection& encoder) {
  if (encoder.name == "sim" || find_unit(encoder.name) != nullptr) {
    refuse(encoder.place, fmt::format("\"{}\" is a protocol: give the encoder another name", encoder.name));
  }
  if (encoder.name.empty() || encoder.name[0] == '-' || encoder.name.find_first_of(":/?") != std::string::npos) {
    refuse(encoder.place, fmt::format("\"{}\" cannot be the name of an encoder: it must not be empty, begin with - or "
                                      "hold any of : / ?",
                                      encoder.name));
  }
}

}  // namespace

void NamedEncoders::check_line(const FileSection& encoder) const {
  const FileSetting* bus = encoder.find("bus");
  const FileSetting* port = encoder.find("port");
  if (bus == nullptr && port == nullptr) {
    refuse(encoder.place, fmt::format("the encoder {} has neither a port nor a bus", encoder.name));
  }
  if (bus == nullptr) return;
  if (port != nullptr) refuse(bus->place, fmt::format("the encoder {} has a port and a bus: give one", encoder.name));
  const std::string& wanted = bus->values[0];
  if (buses_.contains(wanted)) return;
  Names names;
  for (const FileSection& one : file_.buses) names.push_back(one.name);
  refuse(bus->place, fmt::format("there is no bus \"{}\"{}", wanted, suggestion(wanted, names)));
}

void NamedEncoders::check_encoder(const FileSection& encoder) const {
  check_name(encoder);
  Names known{"protocol", "model", "bus", "port", rate_name};
  const FileSetting* protocol = encoder.find("protocol");
  if (protocol != nullptr && !protocol->is_list) {
    const Unit& unit = at(protocol->place, [&]() -> const Unit& { return require_unit(protocol->values[0]); });
    add_options(known, unit);
  }
  add_link_parameters(known);
  check_settings(encoder, known, protocol == nullptr ? "an encoder" : "an encoder of " + protocol->values[0]);
  if (protocol == nullptr) refuse(encoder.place, fmt::format("the encoder {} has no protocol", encoder.name));
  check_line(encoder);
}

namespace {

// Returns the settings of `from` whose names are not in `over`.
std::vector<FileSetting> not_overridden(const FileSection& from, const std::vector<FileSetting>& over) {
  std::vector<FileSetting> settings;
  std::copy_if(
      from.settings.begin(), from.settings.end(), std::back_inserter(settings), [&](const FileSetting& setting) {
        return std::none_of(over.begin(), over.end(), [&](const auto& one) { return one.name == setting.name; });
      });
  return settings;
}

double rate_of(const FileSection& encoder) {
  const FileSetting* rate = encoder.find(rate_name);
  if (rate == nullptr) return 0;
  const std::string& text = rate->values[0];
  const std::optional<double> value = parse_real(text);
  if (!value || *value < 0.001 || *value > 1e6) {
    refuse(rate->place, fmt::format("{} is \"{}\", but must be a number from 0.001 to 1000000", rate_name, text));
  }
  return *value;
}

}  // namespace

NamedEncoders::NamedEncoders(SettingsFile file) : file_(std::move(file)) {
  check_defaults(file_.defaults);
  for (const FileSection& bus : file_.buses) {
    check_bus(bus);
    buses_.emplace(bus.name, &bus);
  }
  for (const FileSection& encoder : file_.encoders) {
    check_encoder(encoder);
    encoders_.emplace(encoder.name, &encoder);
    if (const FileSetting* bus = encoder.find("bus")) ++on_bus_[bus->values[0]];
  }
}

NamedEncoder NamedEncoders::require(std::string_view name) const {
  const auto found = encoders_.find(name);
  if (found == encoders_.end()) {
    Names names;
    for (const FileSection& encoder : file_.encoders) names.push_back(encoder.name);
    throw UsageError(fmt::format("there is no encoder \"{}\" in {}{}", name, file_.path, suggestion(name, names)));
  }
  const FileSection& encoder = *found->second;
  const FileSetting* bus = encoder.find("bus");
  const FileSection& line = bus == nullptr ? encoder : *buses_.at(bus->values[0]);
  const FileSetting& port = *line.find("port");

  const std::string& protocol = encoder.find("protocol")->values[0];
  const std::string& where = port.values[0];
  NamedEncoder named{where == "sim" ? "sim:" + protocol : protocol + ":" + where,
                     port.place,
                     encoder.settings,
                     {},
                     false,
                     rate_of(encoder)};
  if (bus != nullptr) {
    for (FileSetting& setting : not_overridden(line, encoder.settings)) named.settings.push_back(std::move(setting));
  }
  named.has_company = bus != nullptr && on_bus_.at(bus->values[0]) > 1;
  named.defaults = not_overridden(file_.defaults, named.settings);
  std::erase_if(named.settings, [](const FileSetting& setting) {
    return setting.name == "protocol" || setting.name == "bus" || setting.name == "port" || setting.name == rate_name;
  });
  return named;
}

NamedEncoders require_names(std::string_view purpose) {
  if (std::optional<SettingsFile> config = load_settings_file()) return NamedEncoders(*std::move(config));
  if (!reads_settings_file()) {
    throw UsageError(fmt::format("{}, which this program does not read: build it with absenc::configuration", purpose));
  }
  const std::string_view protocol = all_units()[0]->id;
  throw UsageError(
      fmt::format("{}, and there is none: looked for {}. An encoder is named there like this:\n"
                  "  [encoder.elbow]\n  protocol = \"{}\"\n  port = \"{}\"",
                  purpose, fmt::join(settings_file_paths(), " and "), protocol, os::example_port()));
}

}  // namespace absenc::client
