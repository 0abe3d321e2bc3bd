// SPDX-License-Identifier: Apache-2.0
// MQTT topics and payloads, as defined in docs/mqtt.md and docs/mqtt-schema.json.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/serve/outbox.hpp"
#include "absenc/serve/outlets.hpp"
#include "absenc/serve/server_event.hpp"
#include "absenc/serve/watch.hpp"

namespace absenc::serve {

/// Returns a name as one level of a topic: each byte other than an ASCII letter or digit, - or _ becomes %XX.
[[nodiscard]] std::string topic_level(std::string_view name);

/// Returns the MQTT topic PREFIX/ENCODER/KIND; PREFIX/KIND if `encoder` is "".
[[nodiscard]] std::string topic_of(const std::string& prefix, std::string_view encoder, std::string_view kind);

/// Returns the payload of a message with readings. `first`: number of the first reading.
[[nodiscard]] std::string readings_text(const std::string& id, const Watch& watch, std::uint64_t first,
                                        std::span<const OutgoingReading> readings);
[[nodiscard]] std::string event_text(const std::string& id, const ServerEvent& server_event);

/// Returns the payload of the server's state message; `state` is "online" or "offline".
[[nodiscard]] std::string server_state_text(std::string_view state, std::string_view why);

/// A retained MQTT message. It is published again only if `condition`, which describes its content, has changed.
struct Retained {
  std::string topic;
  std::string condition;
  std::string payload;
};
/// Returns the retained message with the state of an encoder. It has no position, which would become outdated.
[[nodiscard]] Retained encoder_state(const std::string& prefix, const Watch& watch, const Snapshot& snapshot);

/// Returns the discovery messages from which Home Assistant creates an encoder's entities.
[[nodiscard]] std::vector<Retained> home_assistant_entities(const MqttSettings& settings, const Watch& watch);
/// Returns the topics of all discovery messages that an encoder of the given name may have.
[[nodiscard]] std::vector<std::string> home_assistant_topics(const MqttSettings& settings, std::string_view encoder);

}  // namespace absenc::serve
