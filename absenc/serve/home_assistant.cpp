// SPDX-License-Identifier: Apache-2.0
// MQTT discovery of Home Assistant (https://www.home-assistant.io/integrations/mqtt/): one device for each encoder.
#include <fmt/format.h>

#include <string>
#include <utility>

#include "absenc/serve/mqtt_messages.hpp"
#include "absenc/serve/view.hpp"

namespace absenc::serve {

using namespace client;

namespace {

/// Returns `text` as an object id of Home Assistant: other characters than those allowed in one are replaced.
std::string object_id(std::string_view text) {
  std::string id = topic_level(text);
  for (char& c : id) {
    if (c == '%') c = '_';
  }
  return id;
}

std::string device_id(const MqttSettings& settings, std::string_view encoder) {
  return fmt::format("absenc_{}_{}", object_id(settings.prefix), object_id(encoder));
}

std::string config_topic(const MqttSettings& settings, std::string_view encoder, std::string_view kind,
                         std::string_view key) {
  return fmt::format("{}/{}/{}/{}/config", settings.home_assistant, kind, device_id(settings, encoder), key);
}

class Discovery {
 public:
  Discovery(const MqttSettings& settings, const Watch& watch)
      : settings_(&settings),
        watch_(&watch),
        id_(device_id(settings, watch.name())),
        value_topic_(topic_of(settings.prefix, watch.name(), "value")),
        state_topic_(topic_of(settings.prefix, watch.name(), "state")) {}

  [[nodiscard]] Json entity(std::string_view key, std::string_view name) const {
    Json server = Json::object().set("topic", topic_of(settings_->prefix, "", "state"));
    server.set("value_template", "{{ value_json.state }}");
    Json encoder = Json::object().set("topic", state_topic_);
    encoder.set("value_template", "{{ 'online' if value_json.state == 'live' else 'offline' }}");
    Json identifiers = Json::array().append(id_);
    Json device = Json::object().set("identifiers", identifiers).set("name", watch_->name());
    device.set("manufacturer", "absenc").set("model", watch_->address().unit->name);
    return Json::object()
        .set("name", name)
        .set("unique_id", id_ + "_" + std::string(key))
        .set("device", device)
        .set("availability", Json::array().append(server).append(encoder))
        .set("availability_mode", "all");
  }

  [[nodiscard]] Retained retained(std::string_view kind, std::string_view key, const Json& entity) const {
    std::string text = entity.line();
    return {config_topic(*settings_, watch_->name(), kind, key), text, text};
  }

  [[nodiscard]] Retained sensor(std::string_view key, std::string_view name, std::string_view unit) const {
    Json json = entity(key, name);
    json.set("state_topic", value_topic_).set("value_template", fmt::format("{{{{ value_json.{} }}}}", key));
    json.set("state_class", "measurement");
    if (!unit.empty()) json.set("unit_of_measurement", unit);
    return retained("sensor", key, json);
  }

  [[nodiscard]] Retained alarm() const {
    Json json = entity("alarm", "Alarm");
    json.set("state_topic", state_topic_).set("device_class", "problem");
    // Home Assistant shows the value None as "unknown": the encoder has not reported whether an alarm is raised.
    json.set("value_template", "{{ 'ON' if value_json.alarms else 'None' if value_json.alarms is none else 'OFF' }}");
    json.set("json_attributes_topic", state_topic_);
    return retained("binary_sensor", "alarm", json);
  }

 private:
  const MqttSettings* settings_;
  const Watch* watch_;
  std::string id_;
  std::string value_topic_;
  std::string state_topic_;
};

}  // namespace

std::vector<Retained> home_assistant_entities(const MqttSettings& settings, const Watch& watch) {
  const Discovery discovery(settings, watch);
  const bool linear = is_linear(watch);
  std::vector<Retained> all;
  all.push_back(linear ? discovery.sensor("position_mm", "Position", "mm")
                       : discovery.sensor("angle_deg", "Angle", "°"));
  all.push_back(discovery.sensor("speed", "Speed", linear ? "mm/s" : "rpm"));
  if (!linear) all.push_back(discovery.sensor("turns", "Turns", ""));
  all.push_back(discovery.alarm());
  return all;
}

std::vector<std::string> home_assistant_topics(const MqttSettings& settings, std::string_view encoder) {
  std::vector<std::string> topics{config_topic(settings, encoder, "binary_sensor", "alarm")};
  for (const std::string_view key : {"angle_deg", "position_mm", "speed", "turns"}) {
    topics.push_back(config_topic(settings, encoder, "sensor", key));
  }
  return topics;
}

}  // namespace absenc::serve
