// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt_sender.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/network.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/view.hpp"

namespace absenc::serve {

using namespace client;

namespace {

using namespace std::chrono_literals;

// greatest number of spooled messages that are sent and not acknowledged
constexpr std::size_t most_messages_out = 500;
constexpr Time one_wait = 20ms;
constexpr Time state_interval = 200ms;
// usual time between two checks of the encoders' states, if there are more than `many` encoders
constexpr Time many_state_interval = 1s;
constexpr std::size_t many = 50;
constexpr Time value_interval = 1s;  // time between two publications of values for Home Assistant
constexpr Time first_pause = 500ms;  // first pause between attempts to connect; it doubles up to `longest_pause`
constexpr Time longest_pause = 5s;
constexpr Time time_to_connect = 10s;
constexpr Time time_to_finish = 1s;
// A connection that lasted this long is stable: the pause between attempts to connect may be short again.
constexpr Time stable_time = 10s;
// Shortest time between two events that report a connection, unless the later connection is stable.
constexpr Time connection_report_interval = 60s;

}  // namespace

MqttSender::MqttSender(const MqttSettings& settings, Spool& spool, const Fleet& fleet, ServerEvents& server_events)
    : settings_(&settings), spool_(&spool), fleet_(&fleet), server_events_(&server_events) {
  for (const auto& [name, next] : spool.next_numbers()) served_.insert(name);
  static_cast<void>(MqttClient(settings.broker, identity(), version_));
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

MqttSender::~MqttSender() {
  thread_.request_stop();
  thread_.join();
}

MqttIdentity MqttSender::identity() const {
  return {"absenc-" + spool_->source(), topic_of(settings_->prefix, "", "state"),
          server_state_text("offline", "the connection was lost")};
}

MqttSender::Figures MqttSender::figures() const {
  const std::lock_guard lock(mutex_);
  return figures_;
}

void MqttSender::work(const std::stop_token& stop) {
  Time pause = first_pause;
  while (!stop.stop_requested()) {
    const MqttVersion tried = version_;
    try {
      run_connection(stop);
    } catch (const Failure& failure) {
      set_lost(failure.what());
    } catch (const os::Failure& failure) {  // thrown, for example, if the broker's host name cannot be resolved
      set_lost(failure.what());
    }
    if (version_ != tried) continue;
    version_ = MqttVersion::v5;  // MQTT 5 is tried again: the broker may have been updated, or its answer was a mistake
    const bool was_stable = connected_at_ != Time{} && os::now() - connected_at_ >= stable_time;
    if (has_acknowledged_ && was_stable) pause = first_pause;
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, pause, [] { return false; });
    pause = std::min(2 * pause, longest_pause);
  }
}

void MqttSender::run_connection(const std::stop_token& stop) {
  outstanding_.clear();
  messages_out_.clear();
  last_checked_id_ = 0;
  refusals_.begin_connection();
  has_acknowledged_ = false;
  connected_at_ = {};
  retained_.clear();
  next_states_ = {};
  std::vector<std::string> hosts = os::addresses_of(settings_->broker.host);
  // With TLS the client connects to the host name and not to an IP address, because the certificate names the host.
  const bool by_name = settings_->broker.tls;
  const bool try_all = by_name && hosts.size() > 1;
  if (by_name) hosts = {settings_->broker.host};
  std::string why;
  for (const std::string& host : hosts) {
    MqttClient client(settings_->broker, identity(), version_);
    const MqttClient::State state = connect(client, host, try_all, stop);
    if (stop.stop_requested()) return;
    if (client.wrong_version()) {
      version_ = MqttVersion::v3_1_1;
      return;
    }
    if (state == MqttClient::State::connected) {
      begin();
      return deliver(client, stop);
    }
    note_death(client);
    why = state == MqttClient::State::lost ? client.trouble() : "it does not respond";
  }
  throw Failure(why);
}

MqttClient::State MqttSender::connect(MqttClient& client, const std::string& host, bool try_all,
                                      const std::stop_token& stop) const {
  const Time deadline = os::now() + time_to_connect;
  client.connect(host, try_all);
  MqttClient::State state = MqttClient::State::connecting;
  while (state == MqttClient::State::connecting && !stop.stop_requested() && os::now() < deadline) {
    state = client.work(one_wait);
  }
  return state;
}

void MqttSender::begin() {
  connected_at_ = os::now();
  connection_reported_ = false;
  const std::lock_guard lock(mutex_);
  figures_.connected = true;
  figures_.trouble = refusals_.text();
}

// An unstable connection must not fill the history with events.
void MqttSender::report_connected() {
  if (connection_reported_) return;
  if (os::now() < next_connection_report_ && os::now() - connected_at_ < stable_time) return;
  connection_reported_ = true;
  next_connection_report_ = os::now() + connection_report_interval;
  reported_losses_.clear();
  const bool old = version_ == MqttVersion::v3_1_1;
  add_event(fmt::format("connected to {}{}", settings_->broker.text(),
                        old ? ", which supports MQTT 3.1.1 only and cannot report a refused message" : ""));
}

void MqttSender::deliver(MqttClient& client, const std::stop_token& stop) {
  send_retained(client, {topic_of(settings_->prefix, "", "state"), "online", server_state_text("online", "")});
  while (!stop.stop_requested()) {
    if (os::now() >= next_states_ || refusals_.has_suspects()) {
      next_states_ = os::now() + (fleet_->all().size() > many ? many_state_interval : state_interval);
      send_states(client);
    }
    if (!settings_->home_assistant.empty() && os::now() >= next_values_) {
      next_values_ = os::now() + value_interval;
      send_values(client);
    }
    step(client);
  }
  finish(client);
}

void MqttSender::step(MqttClient& client) {
  report_connected();
  send_messages(client);
  const bool lost = client.work(one_wait) == MqttClient::State::lost;
  settle(client);  // acknowledgements that arrived before the connection was lost are handled, too
  if (!lost) return;
  note_death(client);
  // Topics are suspected of ending the connection only if the client process lives: if it died, a packet was the cause.
  if (!client.died()) note_lost_connection();
  throw Failure(client.trouble());
}

// Records which topics may have made the broker close the connection: some brokers do this instead of refusing a
// message.
void MqttSender::note_lost_connection() {
  std::set<std::string> topics;
  for (const auto& [number, sent] : outstanding_) topics.insert(sent.topic);
  const bool soon = os::now() - connected_at_ < stable_time;
  const std::string refused = refusals_.end_connection(topics, soon, os::now());
  if (!refused.empty())
    add_event(fmt::format("the broker refuses {}: it closes the connection at this message", refused));
}

void MqttSender::note_death(const MqttClient& client) {
  if (!client.died()) return;
  const std::lock_guard lock(mutex_);
  ++figures_.client_deaths;
}

void MqttSender::finish(MqttClient& client) {
  const Time deadline = os::now() + time_to_finish;
  send_states(client);
  while (os::now() < deadline && (spool_->stored().messages != 0 || !outstanding_.empty())) step(client);
  send_retained(client, {topic_of(settings_->prefix, "", "state"), "ended", server_state_text("offline", "it ended")});
  while (os::now() < deadline && !outstanding_.empty()) step(client);
  client.end();
  const std::lock_guard lock(mutex_);
  figures_.connected = false;
}

void MqttSender::send_states(MqttClient& client) {
  const Fleet::Watches watches = fleet_->all();
  clear_unserved(client, watches);
  for (const auto& watch : watches) {
    if (!settings_->home_assistant.empty() &&
        !retained_.contains(topic_of(settings_->prefix, watch->name(), "state"))) {
      for (const Retained& one : home_assistant_entities(*settings_, *watch)) send_retained(client, one);
    }
    send_retained(client, encoder_state(settings_->prefix, *watch, watch->snapshot()));
  }
}

void MqttSender::clear_unserved(MqttClient& client, const Fleet::Watches& watches) {
  std::set<std::string> now;
  for (const auto& watch : watches) now.insert(watch->name());
  std::set<std::string> refused;
  for (const std::string& name : served_) {
    if (now.contains(name)) continue;
    std::vector<std::string> topics{topic_of(settings_->prefix, name, "state")};
    if (!settings_->home_assistant.empty())
      std::ranges::move(home_assistant_topics(*settings_, name), std::back_inserter(topics));
    bool are_sent = true;
    for (const std::string& topic : topics) are_sent = send_retained(client, {topic, "", ""}) && are_sent;
    if (are_sent) {
      for (const std::string& topic : topics) retained_.erase(topic);
      spool_->forget(name);
    } else {
      refused.insert(name);
    }
  }
  served_ = std::move(now);
  served_.merge(refused);
}

void MqttSender::send_values(MqttClient& client) {
  for (const auto& watch : fleet_->all()) {
    const Snapshot snapshot = watch->snapshot();
    if (snapshot.state != State::live) continue;
    const std::string text = overview(*watch, snapshot).line();
    client.publish(topic_of(settings_->prefix, watch->name(), "value"), text, 0, false);
  }
}

// Publishes a retained message, unless its Retained::condition is that of the last message of the topic. Returns
// whether the broker has the message or gets it now.
bool MqttSender::send_retained(MqttClient& client, const Retained& retained) {
  const auto known = retained_.find(retained.topic);
  if (known != retained_.end() && known->second == retained.condition) return true;
  if (refusals_.verdict(retained.topic, outstanding_.size(), os::now()) != MqttRefusals::Verdict::send) return false;
  retained_[retained.topic] = retained.condition;
  outstanding_[client.publish(retained.topic, retained.payload, 1, true)] = {0, retained.topic};
  refusals_.sent(retained.topic);
  return true;
}

void MqttSender::send_messages(MqttClient& client) {
  if (refusals_.take_due(os::now())) last_checked_id_ = 0;
  if (messages_out_.size() >= most_messages_out || spool_->stored().messages <= messages_out_.size()) return;
  for (const Message& one : spool_->after(last_checked_id_, most_messages_out)) {
    const MqttRefusals::Verdict verdict = refusals_.verdict(one.topic, outstanding_.size(), os::now());
    const bool is_out = messages_out_.contains(one.id);
    if (!is_out && (verdict == MqttRefusals::Verdict::wait || messages_out_.size() >= most_messages_out)) return;
    last_checked_id_ = one.id;
    if (is_out || verdict == MqttRefusals::Verdict::skip) continue;
    outstanding_[client.publish(one.topic, one.payload, 1, false)] = {one.id, one.topic};
    messages_out_.insert(one.id);
    refusals_.sent(one.topic);
  }
}

// A message that the broker refuses stays in the spool.
void MqttSender::settle(MqttClient& client) {
  std::vector<std::int64_t> arrived;
  for (const MqttClient::Acknowledgement& one : client.take_acknowledgements()) {
    const auto found = outstanding_.find(one.number);
    // the acknowledgement is for a message with QoS 0, which `outstanding_` does not contain
    if (found == outstanding_.end()) continue;
    const Outstanding sent = found->second;
    outstanding_.erase(found);
    messages_out_.erase(sent.message);
    if (!one.refused.empty()) {
      settle_refused(sent, one.refused);
      continue;
    }
    settle_taken(sent);
    if (sent.message != 0) arrived.push_back(sent.message);
  }
  if (arrived.empty()) return;
  spool_->remove(arrived);
  has_acknowledged_ = true;
  const std::lock_guard lock(mutex_);
  figures_.sent += arrived.size();
}

void MqttSender::settle_refused(const Outstanding& sent, const std::string& why) {
  const bool is_new = refusals_.refuse(sent.topic, why, os::now());
  // the retained state is sent again when the pause of its topic is over
  if (sent.message == 0) retained_.erase(sent.topic);
  {
    const std::lock_guard lock(mutex_);
    figures_.trouble = refusals_.text();
  }
  if (is_new) add_event(fmt::format("the broker refuses {}: {}", sent.topic, why));
}

void MqttSender::settle_taken(const Outstanding& sent) {
  if (!refusals_.take(sent.topic)) return;
  // other messages of this topic were skipped, so the search for messages to send begins at the first id again
  last_checked_id_ = 0;
  {
    const std::lock_guard lock(mutex_);
    figures_.trouble = refusals_.text();
  }
  add_event(fmt::format("the broker accepts {} again", sent.topic));
}

void MqttSender::set_lost(const std::string& why) {
  {
    const std::lock_guard lock(mutex_);
    figures_.connected = false;
    figures_.trouble = refusals_.text().empty() ? why : refusals_.text();
  }
  if (!reported_losses_.insert(why).second) return;
  add_event(fmt::format("{} is not reachable: {}; messages wait on disk", settings_->broker.text(), why));
}

void MqttSender::add_event(const std::string& text) { server_events_->add({calendar_ms(), "", "mqtt", text}); }

}  // namespace absenc::serve
