// SPDX-License-Identifier: Apache-2.0
// Sends readings to other systems by MQTT and UDP. The settings can change while it runs.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absenc/serve/mqtt.hpp"
#include "absenc/serve/udp.hpp"

namespace absenc::serve {

class Sending {
 public:
  /// Both arguments must outlive this object. Nothing is sent before `change_to`.
  Sending(const Fleet& fleet, ServerEvents& server_events) : fleet_(&fleet), server_events_(&server_events) {}

  /// Applies new settings of MQTT and UDP and returns the changes in words, each with a leading semicolon. If MQTT or
  /// UDP cannot be started, it is off and Failure or os::Failure is thrown. To be called from one thread only.
  std::string change_to(const Outlets& outlets);

  void add(const std::vector<ServerEvent>& server_events);
  /// Returns the health of MQTT; its state is "none" if MQTT is off.
  [[nodiscard]] MqttHealth mqtt_health() const;
  /// Returns the health of MQTT as JSON; null if MQTT is off.
  [[nodiscard]] client::Json json() const;
  /// Returns the metrics of MQTT in the text format of Prometheus; "" if MQTT is off.
  [[nodiscard]] std::string metrics() const;

 private:
  [[nodiscard]] std::shared_ptr<Mqtt> mqtt() const;
  void stop_outgoing(Watch::Outlet outlet);

  const Fleet* fleet_;
  ServerEvents* server_events_;
  Outlets current_;
  mutable std::mutex mutex_;  // mutex that guards `mqtt_`; `udp_` is used by `change_to` only
  std::shared_ptr<Mqtt> mqtt_;
  std::unique_ptr<UdpSender> udp_;
};

}  // namespace absenc::serve
