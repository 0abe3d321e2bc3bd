// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/way/named_encoder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>

#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/way/address.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

namespace {

using Names = std::vector<std::string_view>;

constexpr std::string_view rate_name = "rate_hz";  // of `serve`, beside the settings of the encoder

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

// What stands without ':' on the command line, and is no protocol.
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

void check_line(const FileSection& encoder, const std::vector<FileSection>& buses) {
  const FileSetting* bus = encoder.find("bus");
  const FileSetting* port = encoder.find("port");
  if (bus == nullptr && port == nullptr) {
    refuse(encoder.place, fmt::format("the encoder {} has neither a port nor a bus", encoder.name));
  }
  if (bus == nullptr) return;
  if (port != nullptr) refuse(bus->place, fmt::format("the encoder {} has a port and a bus: give one", encoder.name));
  Names names;
  for (const FileSection& one : buses) names.push_back(one.name);
  const std::string& wanted = bus->values[0];
  if (std::find(names.begin(), names.end(), wanted) != names.end()) return;
  refuse(bus->place, fmt::format("there is no bus \"{}\"{}", wanted, suggestion(wanted, names)));
}

void check_encoder(const FileSection& encoder, const std::vector<FileSection>& buses) {
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
  check_line(encoder, buses);
}

// Those of `from` that are not in `over`.
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
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  const bool whole = !text.empty() && end == text.c_str() + text.size();
  if (!whole || !(value >= 0.001 && value <= 1e6)) {
    refuse(rate->place, fmt::format("{} is \"{}\", but must be a number from 0.001 to 1000000", rate_name, text));
  }
  return value;
}

const FileSection& section_named(const std::vector<FileSection>& sections, std::string_view name) {
  return *std::find_if(sections.begin(), sections.end(), [&](const auto& section) { return section.name == name; });
}

}  // namespace

void check(const SettingsFile& config) {
  check_defaults(config.defaults);
  for (const FileSection& bus : config.buses) check_bus(bus);
  for (const FileSection& encoder : config.encoders) check_encoder(encoder, config.buses);
}

NamedEncoder require_encoder(const SettingsFile& config, std::string_view name) {
  Names names;
  for (const FileSection& encoder : config.encoders) names.push_back(encoder.name);
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    throw UsageError(fmt::format("there is no encoder \"{}\" in {}{}", name, config.path, suggestion(name, names)));
  }
  const FileSection& encoder = section_named(config.encoders, name);
  const FileSetting* bus = encoder.find("bus");
  const FileSection& line = bus == nullptr ? encoder : section_named(config.buses, bus->values[0]);
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
  named.has_company =
      bus != nullptr && std::any_of(config.encoders.begin(), config.encoders.end(), [&](const FileSection& other) {
        const FileSetting* its = other.find("bus");
        return other.name != encoder.name && its != nullptr && its->values[0] == bus->values[0];
      });
  named.defaults = not_overridden(config.defaults, named.settings);
  std::erase_if(named.settings, [](const FileSetting& setting) {
    return setting.name == "protocol" || setting.name == "bus" || setting.name == "port" || setting.name == rate_name;
  });
  return named;
}

SettingsFile require_settings_file(std::string_view purpose) {
  if (std::optional<SettingsFile> config = load_settings_file()) {
    check(*config);
    return *std::move(config);
  }
  const std::string_view protocol = all_units()[0]->id;
  throw UsageError(
      fmt::format("{}, and there is none: looked for {}. An encoder is named there like this:\n"
                  "  [encoder.elbow]\n  protocol = \"{}\"\n  port = \"/dev/ttyUSB0\"",
                  purpose, fmt::join(settings_file_paths(), " and "), protocol));
}

}  // namespace absenc::client
