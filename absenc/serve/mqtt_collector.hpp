// SPDX-License-Identifier: Apache-2.0
// Writes readings and events to the MQTT spool, in its own thread.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absenc/serve/fleet.hpp"
#include "absenc/serve/outlets.hpp"
#include "absenc/serve/spool.hpp"

namespace absenc::serve {

class MqttCollector {
 public:
  /// Starts the collector thread. All arguments must outlive this object.
  MqttCollector(const MqttSettings& settings, Spool& spool, const Fleet& fleet, ServerEvents& server_events);
  /// Writes the remaining readings and events to the spool.
  ~MqttCollector();

  void add(const std::vector<ServerEvent>& server_events);

  struct Figures {
    std::string trouble{};      // why the spool cannot be written; "" without an error
    std::uint64_t dropped = 0;  // number of readings lost since this object was made
    bool drops = false;         // whether readings were dropped within the last 30 seconds
    // number of the last reading that is in the spool on disk or was sent, by name of the encoder
    std::map<std::string, std::uint64_t> taken{};
  };
  [[nodiscard]] Figures figures() const;

 private:
  void work(const std::stop_token& stop);
  void collect();
  void collect_readings(const Watch& watch, std::vector<OutgoingReading> readings, std::vector<Message>& messages);
  void spool(const std::vector<Message>& messages, const std::map<std::string, std::uint64_t>& changed);
  void note_dropped(const Spool::Counts& dropped, const std::string& why);
  [[nodiscard]] std::string id_text(std::int64_t id) const;

  const MqttSettings* settings_;
  Spool* spool_;
  const Fleet* fleet_;
  ServerEvents* server_events_;

  // The members from here to `mutex_` are used by one thread at a time: the collector thread, then the destructor.
  std::int64_t next_id_;
  std::map<std::string, std::uint64_t> next_numbers_;  // number of the next reading, by name of the encoder
  // Number of the last reading that was given to the spool, by name of the encoder; copied into `Figures::taken` as
  // soon as the spool keeps no message in memory.
  std::map<std::string, std::uint64_t> not_on_disk_;
  Spool::Counts unreported_{};  // counts of dropped messages and readings that no event has reported yet
  std::string unreported_reason_;
  Time next_report_{};

  mutable std::mutex mutex_;  // mutex that guards all members below except `thread_`
  std::condition_variable_any changed_;
  std::vector<ServerEvent> waiting_;
  Figures figures_;
  Time last_dropped_{};
  std::jthread thread_;  // the last member: when the thread starts, all members that it uses exist
};

}  // namespace absenc::serve
