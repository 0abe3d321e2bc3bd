// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt_refusals.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace absenc::serve {

namespace {

using namespace std::chrono_literals;

constexpr Time first_refusal_pause = 2s;
constexpr Time longest_refusal_pause = 60s;
constexpr const char* connection_ends = "the broker closes the connection at this message";

}  // namespace

MqttRefusals::Verdict MqttRefusals::verdict(const std::string& topic, std::size_t on_their_way, Time now) const {
  const auto refused = refused_.find(topic);
  if (refused != refused_.end() && (now < refused->second.retry || refused->second.is_tried)) return Verdict::skip;
  if (suspect_is_out_) return Verdict::wait;
  return suspects_.contains(topic) && on_their_way != 0 ? Verdict::wait : Verdict::send;
}

void MqttRefusals::sent(const std::string& topic) {
  if (suspects_.contains(topic)) suspect_is_out_ = true;
  if (const auto refused = refused_.find(topic); refused != refused_.end()) refused->second.is_tried = true;
}

bool MqttRefusals::refuse(const std::string& topic, const std::string& why, Time now) {
  suspect_is_out_ = false;
  // A topic that the broker has refused is no longer suspected of making the broker close the connection.
  suspects_.erase(topic);
  const auto [place, is_new] = refused_.try_emplace(topic);
  Refused& refused = place->second;
  const bool is_another = refused.why != why;
  refused.why = why;
  // the message was sent before the first refusal of its topic, so the pause does not double
  if (!is_new && !refused.is_tried) return is_another;
  refused.ends_connection = why == connection_ends;
  refused.pause = is_new ? first_refusal_pause : std::min(2 * refused.pause, longest_refusal_pause);
  refused.retry = now + refused.pause;
  refused.is_tried = refused.is_due = false;
  return is_another;
}

bool MqttRefusals::take(const std::string& topic) {
  if (suspects_.erase(topic) != 0) suspect_is_out_ = false;
  return refused_.erase(topic) != 0;
}

void MqttRefusals::begin_connection() {
  suspect_is_out_ = false;
  for (auto& [topic, refused] : refused_) {
    refused.is_tried = false;
    if (refused.ends_connection) suspects_.insert(topic);
  }
}

std::string MqttRefusals::end_connection(const std::set<std::string>& on_their_way, bool soon, Time now) {
  const bool was_alone = suspect_is_out_ && on_their_way.size() == 1;
  suspect_is_out_ = false;
  ends_in_a_row_ = soon ? ends_in_a_row_ + 1 : 1;
  if (was_alone) {
    const std::string& topic = *on_their_way.begin();
    return refuse(topic, connection_ends, now) ? topic : std::string();
  }
  if (ends_in_a_row_ >= 2) suspects_.insert(on_their_way.begin(), on_their_way.end());
  return {};
}

bool MqttRefusals::take_due(Time now) {
  bool any = false;
  for (auto& [topic, refused] : refused_) {
    if (refused.is_due || now < refused.retry) continue;
    any = refused.is_due = true;
    if (refused.ends_connection) suspects_.insert(topic);
  }
  return any;
}

std::string MqttRefusals::text() const {
  if (refused_.empty()) return {};
  const auto& [topic, refused] = *refused_.begin();
  const std::string others = refused_.size() == 1 ? "" : fmt::format(", and {} other topics", refused_.size() - 1);
  return fmt::format("the broker refuses a message: {} ({}){}; it stays in the spool, other topics are sent",
                     refused.why, topic, others);
}

}  // namespace absenc::serve
