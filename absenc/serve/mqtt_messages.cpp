// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt_messages.hpp"

#include <fmt/format.h>

#include <cmath>
#include <concepts>
#include <iterator>

#include "absenc/client/reading.hpp"
#include "absenc/serve/view.hpp"

namespace absenc::serve {

using namespace client;

namespace {

std::string_view place_unit(const Watch& watch) { return is_linear(watch) ? "mm" : "deg"; }
std::string_view speed_unit(const Watch& watch) { return is_linear(watch) ? "mm/s" : "rpm"; }

void append(std::string& text, const std::optional<double>& value) {
  if (!value || !std::isfinite(*value)) {
    text += "null";
  } else {
    fmt::format_to(std::back_inserter(text), "{}", *value);
  }
}

template <std::integral Number>
void append(std::string& text, const std::optional<Number>& value) {
  text += value ? fmt::format_int(*value).c_str() : "null";
}

void append_angles(std::string& text, const OutgoingReading& one) {
  text += ',';
  append(text, one.joint);
  text += ',';
  append(text, one.joint_speed ? std::optional(one.joint_speed->value) : std::nullopt);
  text += ',';
  append(text, one.joint_speed ? std::optional(one.joint_speed->uncertainty) : std::nullopt);
  text += ',';
  append(text, one.electrical_deg);
}

}  // namespace

std::string topic_level(std::string_view name) {
  std::string level;
  for (const char c : name) {
    const bool plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    if (plain) {
      level += c;
    } else {
      fmt::format_to(std::back_inserter(level), "%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return level;
}

std::string topic_of(const std::string& prefix, std::string_view encoder, std::string_view kind) {
  return encoder.empty() ? fmt::format("{}/{}", prefix, kind)
                         : fmt::format("{}/{}/{}", prefix, topic_level(encoder), kind);
}

std::string readings_text(const std::string& id, const Watch& watch, std::uint64_t first,
                          std::span<const OutgoingReading> readings) {
  std::string text = Json::object()
                         .set("id", id)
                         .set("encoder", watch.name())
                         .set("protocol", watch.address().unit->id)
                         .set("position_unit", place_unit(watch))
                         .set("speed_unit", speed_unit(watch))
                         .set("first", first)
                         .line();
  const Joint& joint = watch.address().joint;
  const bool has_angles = joint.is_set || joint.has_motor();
  text.back() = ',';
  text += "\"readings\":[";
  for (const OutgoingReading& one : readings) {
    if (&one != readings.data()) text += ',';
    fmt::format_to(std::back_inserter(text), "[{},", one.at_us);
    append(text, one.place);
    text += ',';
    append(text, one.speed ? std::optional(one.speed->value) : std::nullopt);
    text += ',';
    append(text, one.counts);
    text += ',';
    append(text, one.turns);
    text += ',';
    append(text, one.speed ? std::optional(one.speed->uncertainty) : std::nullopt);
    if (has_angles) append_angles(text, one);
    text += ']';
  }
  return text + "]}";
}

std::string event_text(const std::string& id, const ServerEvent& server_event) {
  return server_event.json().set("id", id).line();
}

std::string server_state_text(std::string_view state, std::string_view why) {
  return Json::object().set("state", state).set("why", why).line();
}

Retained encoder_state(const std::string& prefix, const Watch& watch, const Snapshot& snapshot) {
  Json json = condition_json(watch, snapshot);
  const std::string condition = json.line();
  return {topic_of(prefix, watch.name(), "state"), condition, json.set("at_ms", calendar_ms()).line()};
}

}  // namespace absenc::serve
