// SPDX-License-Identifier: Apache-2.0
// Readings, events and states to an MQTT broker, by way of a spool on disk. Two threads: a broker that is away or a
// name that is looked up for long keeps nothing from the spool, and neither keeps an encoder from being read.
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
  std::string trouble{};      // why it is not, what it refuses, or why the spool cannot be written; "": nothing
  bool failing = false;       // what is read cannot be spooled, or the spool drops the oldest of it
  std::uint64_t waiting = 0;  // messages in the spool
  std::int64_t waiting_bytes = 0;
  std::uint64_t sent = 0;           // messages that the broker has taken since the start
  std::uint64_t dropped = 0;        // readings since the start: the spool was full, or could not be written
  std::uint64_t client_deaths = 0;  // of the process that speaks to the broker, since the start
  std::map<std::string, std::uint64_t> taken{};  // by encoder: up to this number, its readings are in the spool or sent

  /// "none", "good", "away" (the broker: what it shall have waits on disk) or "failing": readings are being dropped.
  [[nodiscard]] std::string_view state() const;
  [[nodiscard]] client::Json json() const;
  /// Lines for Prometheus.
  [[nodiscard]] std::string metrics() const;
};

class Mqtt {
 public:
  /// `fleet` and `server_events` outlive it. Throws Failure: the spool or a file cannot be used.
  Mqtt(const MqttSettings& settings, const Fleet& fleet, ServerEvents& server_events);
  /// Spools what there still is; gives a broker that is there a second to take it.
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
