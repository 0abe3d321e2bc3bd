// SPDX-License-Identifier: Apache-2.0
// What sends readings to other systems; can be changed while everything runs.
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
  /// Both outlive it. Nothing is sent yet.
  Sending(const Fleet& fleet, ServerEvents& server_events) : fleet_(&fleet), server_events_(&server_events) {}

  /// What is as before goes on undisturbed. Returns what changed, in words, each with "; " before it. Throws Failure,
  /// os::Failure: what could not be begun is not there, with the rest as it was. From one thread.
  std::string change_to(const Outlets& outlets);

  void add(const std::vector<ServerEvent>& server_events);
  /// Its state is "none" when there is none.
  [[nodiscard]] MqttHealth mqtt_health() const;
  /// Of MQTT, null when there is none.
  [[nodiscard]] client::Json json() const;
  /// For Prometheus.
  [[nodiscard]] std::string metrics() const;

 private:
  [[nodiscard]] std::shared_ptr<Mqtt> mqtt() const;
  void stop_passing(Watch::Outlet outlet);

  const Fleet* fleet_;
  ServerEvents* server_events_;
  Outlets now_;
  mutable std::mutex mutex_;  // guards which there are
  std::shared_ptr<Mqtt> mqtt_;
  std::unique_ptr<UdpSender> udp_;
};

}  // namespace absenc::serve
