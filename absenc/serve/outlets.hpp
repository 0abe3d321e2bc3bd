// SPDX-License-Identifier: Apache-2.0
// Where readings are sent: [serve.mqtt] and [serve.udp] of absenc.toml, and the options of the command for the same.
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
  std::string prefix{};          // of all topics
  std::string spool{};           // the folder
  std::int64_t spool_bytes = 0;  // at most
  Time batch{};                  // what comes within it goes as one message
  std::string home_assistant{};  // the prefix of its discovery; "": it is not used

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

/// "mqtt", "broker", "mqtts://hall.example": as in the file, which it wins over.
struct OutletOption {
  std::string_view section;
  std::string_view setting;
  std::string value;
};

/// Reads absenc.toml, if there is one. Throws UsageError.
[[nodiscard]] Outlets read_outlets(const std::vector<OutletOption>& options);

}  // namespace absenc::serve
