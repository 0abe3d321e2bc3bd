// SPDX-License-Identifier: Apache-2.0
// Topics and payloads of MQTT, as docs/mqtt.md and docs/mqtt-schema.json have them.
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

/// One level of a topic, for any name: what is no letter, digit, - or _ becomes %XX.
[[nodiscard]] std::string topic_level(std::string_view name);

/// PREFIX/ENCODER/KIND; of the server itself, "", PREFIX/KIND.
[[nodiscard]] std::string topic_of(const std::string& prefix, std::string_view encoder, std::string_view kind);

/// `first`: the number of the first of `readings`; they ascend by one.
[[nodiscard]] std::string readings_text(const std::string& id, const Watch& watch, std::uint64_t first,
                                        std::span<const OutgoingReading> readings);
[[nodiscard]] std::string event_text(const std::string& id, const ServerEvent& server_event);

/// Of the server: "online" or "offline".
[[nodiscard]] std::string server_state_text(std::string_view state, std::string_view why);

/// A retained message that is to be, which is sent again when `condition` is another.
struct Retained {
  std::string topic;
  std::string condition;
  std::string payload;
};
/// Whether an encoder is live, its alarms in words; no value, because it is kept.
[[nodiscard]] Retained encoder_state(const std::string& prefix, const Watch& watch, const Snapshot& snapshot);

/// What Home Assistant needs to show an encoder by itself: PREFIX/sensor/.../config.
[[nodiscard]] std::vector<Retained> home_assistant_entities(const MqttSettings& settings, const Watch& watch);
/// All topics of it that an encoder of this name may have.
[[nodiscard]] std::vector<std::string> home_assistant_topics(const MqttSettings& settings, std::string_view encoder);

}  // namespace absenc::serve
