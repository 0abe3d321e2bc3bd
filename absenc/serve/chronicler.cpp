// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/chronicler.hpp"

#include <utility>

namespace absenc::serve {

namespace {

constexpr int seconds_between_trims = 60;

}  // namespace

Chronicler::Chronicler(const std::string& path, const HistoryLimits& limits, const Fleet& fleet)
    : writer_(path, limits), fleet_(&fleet), thread_([this](const std::stop_token& stop) { work(stop); }) {}

Chronicler::~Chronicler() {
  thread_.request_stop();
  thread_.join();
  write();
}

void Chronicler::add(const std::vector<Happening>& happenings) {
  const std::lock_guard lock(mutex_);
  happenings_.insert(happenings_.end(), happenings.begin(), happenings.end());
}

Chronicler::Health Chronicler::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

void Chronicler::work(const std::stop_token& stop) {
  for (int rounds = 1; !stop.stop_requested(); ++rounds) {
    write();
    if (rounds % seconds_between_trims == 0) writer_.trim();
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, std::chrono::seconds(1), [] { return false; });
  }
}

void Chronicler::write() {
  std::vector<HistoryWriter::Entry> seconds;
  for (const auto& watch : fleet_->all()) {
    for (const Second& second : watch->take_seconds()) seconds.push_back({watch->name(), second});
  }
  std::vector<Happening> happenings;
  {
    const std::lock_guard lock(mutex_);
    happenings = std::exchange(happenings_, {});
  }
  writer_.write(seconds, happenings);
  const std::lock_guard lock(mutex_);
  health_ = {writer_.trouble(), writer_.lost()};
}

}  // namespace absenc::serve
