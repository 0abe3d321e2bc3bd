// SPDX-License-Identifier: Apache-2.0
// Sends spooled messages and retained states to the broker, in its own thread.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>

#include "absenc/serve/fleet.hpp"
#include "absenc/serve/mqtt_client.hpp"
#include "absenc/serve/mqtt_messages.hpp"
#include "absenc/serve/mqtt_refusals.hpp"
#include "absenc/serve/outlets.hpp"
#include "absenc/serve/spool.hpp"

namespace absenc::serve {

class MqttSender {
 public:
  /// All arguments must outlive this object. Throws client::Failure or os::Failure if an MQTT client process cannot
  /// start or cannot use the settings.
  MqttSender(const MqttSettings& settings, Spool& spool, const Fleet& fleet, ServerEvents& server_events);
  /// Ends the sender thread. A connected broker has one second to receive the remaining messages.
  ~MqttSender();

  struct Figures {
    bool connected = false;
    std::string trouble{};
    std::uint64_t sent = 0;
    std::uint64_t client_deaths = 0;  // number of unexpected ends of the MQTT client process
  };
  [[nodiscard]] Figures figures() const;

 private:
  struct Outstanding {
    std::int64_t message = 0;  // id of the message in the spool; 0: a retained message, which is not in the spool
    std::string topic{};
  };

  void work(const std::stop_token& stop);
  void run_connection(const std::stop_token& stop);
  MqttClient::State connect(MqttClient& client, const std::string& host, bool try_all,
                            const std::stop_token& stop) const;
  void begin();
  void deliver(MqttClient& client, const std::stop_token& stop);
  void finish(MqttClient& client);
  void step(MqttClient& client);
  void send_states(MqttClient& client);
  void send_values(MqttClient& client);
  bool send_retained(MqttClient& client, const Retained& retained);
  void clear_unserved(MqttClient& client, const Fleet::Watches& watches);
  void send_messages(MqttClient& client);
  void settle(MqttClient& client);
  void settle_refused(const Outstanding& sent, const std::string& why);
  void settle_taken(const Outstanding& sent);
  void note_lost_connection();
  void add_event(const std::string& text);
  void set_lost(const std::string& why);
  void report_connected();
  void note_death(const MqttClient& client);
  [[nodiscard]] MqttIdentity identity() const;

  const MqttSettings* settings_;
  Spool* spool_;
  const Fleet* fleet_;
  ServerEvents* server_events_;

  // The members from here to `mutex_` are used by one thread at a time: the constructor, then the sender thread.
  MqttVersion version_ = MqttVersion::v5;
  // messages with QoS 1 that are sent and not acknowledged, by number
  std::unordered_map<int, Outstanding> outstanding_;
  std::set<std::int64_t> messages_out_;  // ids of the spooled messages in `outstanding_`
  // all spooled messages up to this id were sent or skipped; 0: the search for messages to send begins at the first
  // one
  std::int64_t last_checked_id_ = 0;
  MqttRefusals refusals_;
  std::set<std::string> served_;                 // names of encoders that may have retained messages at the broker
  std::map<std::string, std::string> retained_;  // Retained::condition of the last sent message, by topic
  Time next_states_{};
  Time next_values_{};
  // whether the broker has acknowledged a spooled message since the connection was made
  bool has_acknowledged_ = false;
  Time connected_at_{};
  bool connection_reported_ = false;  // whether an event has reported the current connection
  Time next_connection_report_{};
  // Reasons of lost connections that events have reported since the last event about a new connection.
  std::set<std::string> reported_losses_;

  mutable std::mutex mutex_;  // mutex that guards all members below except `thread_`
  std::condition_variable_any changed_;
  Figures figures_;
  std::jthread thread_;  // the last member: when the thread starts, all members that it uses exist
};

}  // namespace absenc::serve
