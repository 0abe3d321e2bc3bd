// SPDX-License-Identifier: Apache-2.0
// Settings of [serve.mqtt] and [serve.udp] in absenc.toml, and the options that override them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/serve/mqtt_client.hpp"

namespace absenc::serve {

struct MqttSettings {
  Broker broker{};
  std::string prefix{};          // beginning of all MQTT topics, except those of discovery
  std::string spool{};           // path of the folder of the spool
  std::int64_t spool_bytes = 0;  // greatest size of the spool in bytes
  Time batch{};                  // time for which up to 250 readings of an encoder are collected into one message
  std::string home_assistant{};  // prefix of the discovery topics; "": no discovery

  bool operator==(const MqttSettings&) const = default;
};

struct UdpSettings {
  std::string host{};
  std::uint16_t port = 0;

  bool operator==(const UdpSettings&) const = default;
};

struct Outlets {
  std::optional<MqttSettings> mqtt{};
  std::optional<UdpSettings> udp{};
};

/// A command-line option that overrides a setting of absenc.toml. The section "mqtt", the setting "broker" and the
/// value "mqtts://hall.example" override `broker` in [serve.mqtt].
struct OutletOption {
  std::string_view section;
  std::string_view setting;
  std::string value;
};

/// Returns the settings of MQTT and UDP from absenc.toml and the options. Throws UsageError or Failure.
[[nodiscard]] Outlets read_outlets(const std::vector<OutletOption>& options);

}  // namespace absenc::serve
