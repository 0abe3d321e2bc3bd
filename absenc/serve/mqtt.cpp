// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt.hpp"

#include <fmt/format.h>

#include <iterator>

#include "absenc/serve/mqtt_collector.hpp"
#include "absenc/serve/mqtt_sender.hpp"
#include "absenc/serve/spool.hpp"

namespace absenc::serve {

std::string_view MqttHealth::state() const {
  if (broker.empty()) return "none";
  if (failing) return "failing";
  return connected ? "good" : "away";
}

client::Json MqttHealth::json() const {
  using client::Json;
  Json numbers = Json::object();
  for (const auto& [encoder, number] : taken) numbers.set(encoder, number);
  return Json::object()
      .set("broker", broker)
      .set("prefix", prefix)
      .set("connected", connected)
      .set("trouble", trouble)
      .set("waiting", waiting)
      .set("waiting_bytes", waiting_bytes)
      .set("sent", sent)
      .set("dropped", dropped)
      .set("client_deaths", client_deaths)
      .set("taken", numbers);
}

std::string MqttHealth::metrics() const {
  std::string text;
  const auto add = [&](std::string_view name, std::string_view kind, std::string_view help, auto value) {
    fmt::format_to(std::back_inserter(text), "# HELP {0} {1}\n# TYPE {0} {2}\n{0}{{}} {3}\n", name, help, kind, value);
  };
  add("absenc_mqtt_connected", "gauge", "1 while the broker is connected", connected ? 1 : 0);
  add("absenc_mqtt_waiting", "gauge", "messages in the spool", waiting);
  add("absenc_mqtt_waiting_bytes", "gauge", "bytes of messages in the spool", waiting_bytes);
  add("absenc_mqtt_sent_total", "counter", "messages that the broker has acknowledged", sent);
  add("absenc_mqtt_dropped_total", "counter", "readings that the spool could not store", dropped);
  add("absenc_mqtt_client_deaths_total", "counter", "unexpected ends of the MQTT client process", client_deaths);
  return text;
}

// Parts of the MQTT connection in order of dependency: a member uses only members above it.
struct Mqtt::Parts {
  Parts(const MqttSettings& wanted, const Fleet& fleet, ServerEvents& server_events)
      : settings(wanted),
        spool(settings.spool, settings.spool_bytes),
        sender(settings, spool, fleet, server_events),
        collector(settings, spool, fleet, server_events) {}

  MqttSettings settings;
  Spool spool;
  MqttSender sender;
  MqttCollector collector;
};

Mqtt::Mqtt(const MqttSettings& settings, const Fleet& fleet, ServerEvents& server_events)
    : parts_(std::make_unique<Parts>(settings, fleet, server_events)) {}
Mqtt::~Mqtt() = default;

void Mqtt::add(const std::vector<ServerEvent>& server_events) { parts_->collector.add(server_events); }

MqttHealth Mqtt::health() const {
  const MqttCollector::Figures collected = parts_->collector.figures();
  const MqttSender::Figures sent = parts_->sender.figures();
  MqttHealth health;
  health.broker = parts_->settings.broker.text();
  health.prefix = parts_->settings.prefix;
  health.connected = sent.connected;
  health.trouble = collected.trouble.empty() ? sent.trouble : collected.trouble;
  health.failing = !collected.trouble.empty() || collected.drops;
  health.waiting = parts_->spool.stored().messages;
  health.waiting_bytes = parts_->spool.stored_bytes();
  health.sent = sent.sent;
  health.client_deaths = sent.client_deaths;
  health.dropped = collected.dropped;
  health.taken = collected.taken;
  return health;
}

}  // namespace absenc::serve
