// SPDX-License-Identifier: Apache-2.0
// From the spool to the broker, in a thread of its own; and what the broker keeps: the state of the server and of each
// encoder.
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
  /// All outlive it. Throws Failure: a file for the connection cannot be used.
  MqttSender(const MqttSettings& settings, Spool& spool, const Fleet& fleet, ServerEvents& server_events);
  /// A broker that is there has a second to take what there is.
  ~MqttSender();

  struct Figures {
    bool connected = false;
    std::string trouble{};
    std::uint64_t sent = 0;
    std::uint64_t client_deaths = 0;  // of the process that speaks to the broker
  };
  [[nodiscard]] Figures figures() const;

 private:
  struct Outstanding {
    std::int64_t message = 0;  // its id; 0: of a state
    std::string topic{};
  };

  void work(const std::stop_token& stop);
  void attend(const std::stop_token& stop);
  MqttClient::State connect(MqttClient& client, const std::string& host, bool try_all,
                            const std::stop_token& stop) const;
  void begin();
  void deliver(MqttClient& client, const std::stop_token& stop);
  void finish(MqttClient& client);
  void step(MqttClient& client);
  void send_states(MqttClient& client);
  void send_values(MqttClient& client);
  void send_retained(MqttClient& client, const Retained& retained);
  void clear_gone(MqttClient& client, const Fleet::Watches& watches);
  void send_messages(MqttClient& client);
  void settle(MqttClient& client);
  void settle_refused(const Outstanding& sent, const std::string& why);
  void settle_taken(const Outstanding& sent);
  void note_lost_connection();
  void tell(const std::string& text);
  void become_lost(const std::string& why);
  void tell_connected();
  void note_death(const MqttClient& client);
  [[nodiscard]] MqttIdentity identity() const;

  const MqttSettings* settings_;
  Spool* spool_;
  const Fleet* fleet_;
  ServerEvents* server_events_;

  // Of the thread alone.
  MqttVersion version_ = MqttVersion::v5;
  std::unordered_map<int, Outstanding> outstanding_;  // by the number of the library
  std::set<std::int64_t> messages_out_;               // ids, of those
  std::int64_t looked_to_ = 0;  // the id up to which messages were sent, or skipped because their topic is refused
  MqttRefusals refusals_;
  std::set<std::string> served_;                 // encoders of which the broker may keep something
  std::map<std::string, std::string> retained_;  // by topic: the condition that was sent
  Time next_states_{};
  Time next_values_{};
  bool has_taken_ = false;  // the broker, a message on this connection
  Time connected_at_{};
  bool told_connected_ = false;  // of this connection
  Time next_told_connected_{};
  std::set<std::string> told_lost_;  // why nothing arrives, since a connection was told

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  Figures figures_;
  std::jthread thread_;  // last: it uses all of the others
};

}  // namespace absenc::serve
