// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/sending.hpp"

#include <fmt/format.h>

#include <utility>

namespace absenc::serve {

std::string Sending::change_to(const Outlets& outlets) {
  std::string changed;
  if (outlets.mqtt != current_.mqtt) {
    std::shared_ptr<Mqtt> old;
    {
      const std::lock_guard lock(mutex_);
      old = std::exchange(mqtt_, nullptr);
    }
    // the old Mqtt object ends before the new one starts, because the new one may use the same spool, which is locked
    old.reset();
    current_.mqtt.reset();
    std::shared_ptr<Mqtt> next;
    if (outlets.mqtt) next = std::make_shared<Mqtt>(*outlets.mqtt, *fleet_, *server_events_);
    current_.mqtt = outlets.mqtt;
    // If MQTT only gets new settings, the readings in the queues stay for the new Mqtt object.
    if (!outlets.mqtt) stop_outgoing(Watch::Outlet::mqtt);
    changed += fmt::format("; MQTT: {}", outlets.mqtt ? outlets.mqtt->broker.text() : "none");
    const std::lock_guard lock(mutex_);
    mqtt_ = std::move(next);
  }
  if (outlets.udp != current_.udp) {
    udp_.reset();
    current_.udp.reset();
    if (outlets.udp) udp_ = std::make_unique<UdpSender>(*outlets.udp, *fleet_);
    current_.udp = outlets.udp;
    if (!outlets.udp) stop_outgoing(Watch::Outlet::udp);
    changed += fmt::format("; UDP: {}", outlets.udp ? outlets.udp->host : "none");
  }
  return changed;
}

void Sending::stop_outgoing(Watch::Outlet outlet) {
  for (const auto& watch : fleet_->all()) watch->stop_outgoing(outlet);
}

std::shared_ptr<Mqtt> Sending::mqtt() const {
  const std::lock_guard lock(mutex_);
  return mqtt_;
}

void Sending::add(const std::vector<ServerEvent>& server_events) {
  if (const std::shared_ptr<Mqtt> to = mqtt()) to->add(server_events);
}

MqttHealth Sending::mqtt_health() const {
  const std::shared_ptr<Mqtt> of = mqtt();
  return of ? of->health() : MqttHealth{};
}

client::Json Sending::json() const {
  const std::shared_ptr<Mqtt> of = mqtt();
  return of ? of->health().json() : client::Json();
}

std::string Sending::metrics() const {
  const std::shared_ptr<Mqtt> of = mqtt();
  return of ? of->health().metrics() : std::string();
}

}  // namespace absenc::serve
