// SPDX-License-Identifier: Apache-2.0
// From the encoders to the spool, in a thread of its own.
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
  /// All outlive it. Throws Failure.
  MqttCollector(const MqttSettings& settings, Spool& spool, const Fleet& fleet, ServerEvents& server_events);
  /// Spools what there still is.
  ~MqttCollector();

  void add(const std::vector<ServerEvent>& server_events);

  struct Figures {
    std::string trouble{};      // why the spool cannot be written
    std::uint64_t dropped = 0;  // readings
    bool drops = false;         // some within the last seconds
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

  // Of the thread alone.
  std::int64_t next_id_;
  std::map<std::string, std::uint64_t> next_numbers_;  // of readings, by encoder
  std::map<std::string, std::uint64_t> not_on_disk_;   // by encoder: up to this number they wait, partly in memory
  Spool::Counts untold_{};                             // of what was dropped
  std::string untold_why_;
  Time next_told_{};

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  std::vector<ServerEvent> waiting_;
  Figures figures_;
  Time last_dropped_{};
  std::jthread thread_;  // last: it uses all of the others
};

}  // namespace absenc::serve
