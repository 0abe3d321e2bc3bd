// SPDX-License-Identifier: Apache-2.0
// Writes the history once a second, in a thread of its own: a slow disk delays nobody else.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absenc/serve/fleet.hpp"
#include "absenc/serve/history.hpp"

namespace absenc::serve {

class Chronicler {
 public:
  /// `fleet` outlives it. Throws Failure.
  Chronicler(const std::string& path, const HistoryLimits& limits, const Fleet& fleet);
  /// Writes what there still is.
  ~Chronicler();

  void add(const std::vector<Happening>& happenings);

  struct Health {
    std::string trouble{};  // why nothing can be written; "": nothing is wrong
    std::uint64_t lost = 0;
  };
  [[nodiscard]] Health health() const;

 private:
  void work(const std::stop_token& stop);
  void write();

  HistoryWriter writer_;
  const Fleet* fleet_;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  std::vector<Happening> happenings_;
  Health health_;
  std::jthread thread_;  // last: it uses all of the others
};

}  // namespace absenc::serve
