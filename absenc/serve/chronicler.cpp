// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/chronicler.hpp"

#include <algorithm>
#include <utility>

#include "absenc/os/signals.hpp"

namespace absenc::serve {

namespace {

constexpr Time between_trims = std::chrono::seconds(60);

}  // namespace

Chronicler::Chronicler(const std::string& path, const HistoryLimits& limits, const Fleet& fleet)
    : writer_(path, limits), fleet_(&fleet), thread_([this](const std::stop_token& stop) { work(stop); }) {}

Chronicler::~Chronicler() {
  thread_.request_stop();
  thread_.join();
  write();
}

void Chronicler::add(const std::vector<Happening>& happenings, std::uint64_t added) {
  const std::lock_guard lock(mutex_);
  happenings_.insert(happenings_.end(), happenings.begin(), happenings.end());
  added_ = added;
  if (!waiting_.empty()) changed_.notify_all();
}

void Chronicler::when_written(std::uint64_t added, std::function<void()> then) {
  const std::lock_guard lock(mutex_);
  waiting_.emplace_back(added, std::move(then));
  changed_.notify_all();
}

// With the mutex held: whether somebody waits for what can be written.
bool Chronicler::is_awaited() const {
  return std::any_of(waiting_.begin(), waiting_.end(), [this](const auto& one) { return one.first <= added_; });
}

Chronicler::Health Chronicler::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

void Chronicler::work(const std::stop_token& stop) {
  Time next_trim = os::now() + between_trims;
  while (!stop.stop_requested()) {
    write();
    if (os::now() >= next_trim) {
      writer_.trim();
      next_trim = os::now() + between_trims;
    }
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, std::chrono::seconds(1), [this] { return is_awaited(); });
  }
}

void Chronicler::write() {
  std::vector<HistoryWriter::Entry> seconds;
  for (const auto& watch : fleet_->all()) {
    for (const Second& second : watch->take_seconds()) seconds.push_back({watch->name(), second});
  }
  std::vector<Happening> happenings;
  std::uint64_t added = 0;
  {
    const std::lock_guard lock(mutex_);
    happenings = std::exchange(happenings_, {});
    added = added_;
  }
  writer_.write(seconds, happenings);
  std::vector<std::function<void()>> served;
  {
    const std::lock_guard lock(mutex_);
    health_ = {writer_.trouble(), writer_.lost()};
    std::erase_if(waiting_, [&](auto& one) {
      if (one.first > added) return false;
      served.push_back(std::move(one.second));
      return true;
    });
  }
  for (const auto& then : served) then();
}

}  // namespace absenc::serve
