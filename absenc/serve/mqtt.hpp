// SPDX-License-Identifier: Apache-2.0
// Sends readings and events to an MQTT broker through a spool on disk, in threads of its own.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/serve/fleet.hpp"
#include "absenc/serve/outlets.hpp"

namespace absenc::serve {

struct MqttHealth {
  std::string broker{};
  std::string prefix{};
  bool connected = false;
  // Why the broker or the spool does not work; "" if no trouble is known.
  std::string trouble{};
  bool failing = false;       // whether the disk refuses new readings, or readings were dropped within the last 30 s
  std::uint64_t waiting = 0;  // number of messages in the spool
  std::int64_t waiting_bytes = 0;
  // The next three counts begin at 0 when MQTT is started, also after a change of its settings.
  std::uint64_t sent = 0;           // number of spooled messages that the broker has accepted
  std::uint64_t dropped = 0;        // number of readings lost, for example because the spool was full
  std::uint64_t client_deaths = 0;  // number of times that the MQTT client process ended unexpectedly
  // Number of the last reading that is in the spool on disk or was sent, by name of the encoder.
  std::map<std::string, std::uint64_t> taken{};

  /// Returns "none" (no broker is set), "failing", "good" or "away" (not connected).
  [[nodiscard]] std::string_view state() const;
  [[nodiscard]] client::Json json() const;
  /// Returns the metrics of MQTT in the text format of Prometheus.
  [[nodiscard]] std::string metrics() const;
};

class Mqtt {
 public:
  /// `fleet` and `server_events` must outlive this object. Throws Failure or os::Failure.
  Mqtt(const MqttSettings& settings, const Fleet& fleet, ServerEvents& server_events);
  /// Writes the remaining readings and events to the spool. A connected broker has one second to receive them.
  ~Mqtt();
  Mqtt(const Mqtt&) = delete;
  Mqtt& operator=(const Mqtt&) = delete;

  void add(const std::vector<ServerEvent>& server_events);
  [[nodiscard]] MqttHealth health() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace absenc::serve
