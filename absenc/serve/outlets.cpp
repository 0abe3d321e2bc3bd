// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/outlets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>

#include "absenc/client/error.hpp"
#include "absenc/client/port/named_encoder.hpp"
#include "absenc/client/port/settings_file.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/os/network.hpp"
#include "absenc/protocol/options.hpp"
#include "absenc/serve/state_file.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::array<std::string_view, 10> mqtt_names{"broker",   "login_file",    "ca_file", "cert_file",
                                                      "key_file", "prefix",        "spool",   "spool_mb",
                                                      "batch_ms", "home_assistant"};
constexpr std::array<std::string_view, 1> udp_names{"to"};

/// The settings of one section of absenc.toml; command-line options override them.
class SectionValues {
 public:
  SectionValues(std::string_view section, std::span<const std::string_view> known,
                const std::vector<FileSection>& sections, const std::vector<OutletOption>& options) {
    for (const FileSection& one : sections) {
      if (one.name == section) take(one, known);
    }
    for (const OutletOption& one : options) {
      if (one.section == section) values_[one.setting] = {one.value, fmt::format("{} of {}", one.setting, section)};
    }
  }

  [[nodiscard]] bool has(std::string_view name) const { return values_.contains(name); }
  [[nodiscard]] bool empty() const { return values_.empty(); }

  [[nodiscard]] std::string text(std::string_view name, const std::string& fallback = {}) const {
    const auto found = values_.find(name);
    return found == values_.end() ? fallback : found->second.text;
  }

  [[nodiscard]] std::int64_t number(std::string_view name, std::int64_t fallback, std::int64_t least,
                                    std::int64_t most) const {
    if (!has(name)) return fallback;
    const Result<std::int64_t> number = parse_number(text(name));
    if (!number || *number < least || *number > most) {
      refuse(name, fmt::format("must be a whole number from {} to {}", least, most));
    }
    return *number;
  }

  [[noreturn]] void refuse(std::string_view name, std::string_view why) const {
    const Value& value = values_.find(name)->second;
    throw UsageError(fmt::format("{}: {} is \"{}\", but {}", value.place, name, value.text, why));
  }

 private:
  struct Value {
    std::string text;
    std::string place;
  };

  void take(const FileSection& section, std::span<const std::string_view> known) {
    for (const FileSetting& one : section.settings) {
      const auto name = std::find(known.begin(), known.end(), one.name);
      if (name == known.end()) {
        throw UsageError(fmt::format("{}: [serve.{}] has no setting \"{}\"{}", one.place, section.name, one.name,
                                     suggestion(one.name, known)));
      }
      if (one.is_list) throw UsageError(fmt::format("{}: {} takes one value", one.place, one.name));
      values_[*name] = {one.values.front(), one.place};
    }
  }

  std::map<std::string_view, Value> values_;
};

struct HostAndPort {
  std::string host;
  std::optional<std::uint16_t> port;
};

// Parses "HOST:PORT", "HOST", "[IPV6]:PORT" or "[IPV6]"; returns nothing for an invalid text.
std::optional<HostAndPort> host_and_port(std::string_view written) {
  const std::size_t bracket = written.rfind(']');
  const std::size_t colon = written.find(':', bracket == std::string_view::npos ? 0 : bracket);
  std::string_view host = written.substr(0, colon);
  if (host.size() > 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
  if (host.empty()) return {};
  if (colon == std::string_view::npos) return HostAndPort{std::string(host), {}};
  const Result<std::int64_t> port = parse_number(written.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535) return {};
  return HostAndPort{std::string(host), static_cast<std::uint16_t>(*port)};
}

Broker broker_of(const SectionValues& values) {
  Broker broker;
  const std::string text = values.text("broker");
  std::string_view written = text;
  const std::size_t scheme = written.find("://");
  broker.tls = written.starts_with("mqtts://");
  if (scheme != std::string_view::npos) {
    if (!broker.tls && !written.starts_with("mqtt://")) values.refuse("broker", "only mqtt:// and mqtts:// are known");
    written.remove_prefix(scheme + 3);
  }
  const std::optional<HostAndPort> place = host_and_port(written);
  if (!place) values.refuse("broker", "must be mqtt://HOST:PORT, or mqtts:// for TLS");
  broker.host = place->host;
  broker.port = place->port.value_or(broker.tls ? 8883 : 1883);
  broker.login_file = values.text("login_file");
  broker.ca_file = values.text("ca_file");
  broker.cert_file = values.text("cert_file");
  broker.key_file = values.text("key_file");
  for (const std::string_view file : {"ca_file", "cert_file", "key_file"}) {
    if (values.has(file) && !broker.tls) values.refuse(file, "the broker is one without TLS: write mqtts://");
  }
  if (values.has("cert_file") && !values.has("key_file")) values.refuse("cert_file", "key_file is missing");
  if (values.has("key_file") && !values.has("cert_file")) values.refuse("key_file", "cert_file is missing");
  return broker;
}

// Two servers that use the same topic prefix would overwrite each other's state.
std::string usual_prefix() {
  std::string text = os::host_name();
  if (text.empty()) text = "server";
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '/' || c == '+' || c == '#'; }, '-');
  return "absenc/" + text;
}

void check_prefix(const SectionValues& values, std::string_view name, std::string_view prefix) {
  const bool good = !prefix.empty() && prefix.size() <= 256 && prefix.front() != '/' && prefix.front() != '$' &&
                    prefix.back() != '/' && prefix.find("//") == std::string_view::npos &&
                    prefix.find_first_of("+#") == std::string_view::npos &&
                    std::all_of(prefix.begin(), prefix.end(), [](unsigned char c) { return c >= 0x20 && c != 0x7F; });
  if (!good) values.refuse(name, "must be words with / between them, without + and #");
}

MqttSettings mqtt_of(const SectionValues& values) {
  MqttSettings settings;
  if (!values.has("broker")) throw UsageError("[serve.mqtt] needs a broker: broker = \"mqtt://HOST\"");
  settings.broker = broker_of(values);
  settings.prefix = values.text("prefix", usual_prefix());
  if (values.has("prefix")) check_prefix(values, "prefix", settings.prefix);
  settings.spool = values.has("spool") ? values.text("spool") : state_file("mqtt-spool", "spool in [serve.mqtt]");
  settings.spool_bytes = values.number("spool_mb", 256, 1, 1'000'000) * 1'000'000;
  settings.batch = std::chrono::milliseconds(values.number("batch_ms", 100, 10, 60'000));
  settings.home_assistant = values.text("home_assistant");
  if (settings.home_assistant == "true") settings.home_assistant = "homeassistant";
  if (settings.home_assistant == "false") settings.home_assistant.clear();
  if (!settings.home_assistant.empty()) check_prefix(values, "home_assistant", settings.home_assistant);
  return settings;
}

UdpSettings udp_of(const SectionValues& values) {
  const std::optional<HostAndPort> place = host_and_port(values.text("to"));
  if (!place || !place->port) values.refuse("to", "must be HOST:PORT");
  return {place->host, *place->port};
}

}  // namespace

Outlets read_outlets(const std::vector<OutletOption>& options) {
  const std::optional<SettingsFile> file = load_settings_file();
  const std::vector<FileSection> sections = file ? file->services : std::vector<FileSection>{};
  static constexpr std::array<std::string_view, 2> known{"mqtt", "udp"};
  for (const FileSection& one : sections) {
    if (std::find(known.begin(), known.end(), one.name) != known.end()) continue;
    throw UsageError(
        fmt::format("{}: there is no section [serve.{}]{}", one.place, one.name, suggestion(one.name, known)));
  }
  Outlets outlets;
  if (const SectionValues mqtt("mqtt", mqtt_names, sections, options); !mqtt.empty()) outlets.mqtt = mqtt_of(mqtt);
  if (const SectionValues udp("udp", udp_names, sections, options); !udp.empty()) outlets.udp = udp_of(udp);
  return outlets;
}

}  // namespace absenc::serve
