// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/chronicler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "absenc/os/signals.hpp"

namespace absenc::serve {

namespace {

constexpr Time trim_interval = std::chrono::seconds(60);

// Returns a duration as rounded text: "400 days", "2.5 hours".
std::string rough_duration(std::int64_t ms) {
  struct Measure {
    double ms;
    std::string_view name;
  };
  constexpr std::array<Measure, 3> measures{{{86'400'000.0, "days"}, {3'600'000.0, "hours"}, {60'000.0, "minutes"}}};
  for (const Measure& measure : measures) {
    if (static_cast<double>(ms) >= 2 * measure.ms) {
      return fmt::format("{:.4g} {}", static_cast<double>(ms) / measure.ms, measure.name);
    }
  }
  return fmt::format("{} seconds", ms / 1000);
}

}  // namespace

std::int64_t ClockWatch::check(std::int64_t calendar, Time now) {
  const std::int64_t passed = std::chrono::duration_cast<std::chrono::milliseconds>(now - at_).count();
  const std::int64_t jump = has_checked_ ? calendar - calendar_ - passed : 0;
  has_checked_ = true;
  calendar_ = calendar;
  at_ = now;
  return std::abs(jump) < smallest_jump_ms ? 0 : jump;
}

Chronicler::Chronicler(const std::string& path, const HistoryLimits& limits, const Fleet& fleet,
                       ServerEvents& server_events)
    : writer_(path, limits),
      fleet_(&fleet),
      server_events_(&server_events),
      health_{writer_.trouble(), 0},
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

Chronicler::~Chronicler() {
  thread_.request_stop();
  thread_.join();
  write();
}

void Chronicler::add(const std::vector<ServerEvent>& server_events, std::uint64_t added) {
  const std::lock_guard lock(mutex_);
  unwritten_events_.insert(unwritten_events_.end(), server_events.begin(), server_events.end());
  added_ = added;
  if (!waiting_.empty()) changed_.notify_all();
}

void Chronicler::when_written(std::uint64_t added, std::function<void()> then) {
  const std::lock_guard lock(mutex_);
  waiting_.emplace_back(added, std::move(then));
  changed_.notify_all();
}

// Returns whether some action that was passed to `when_written` can run now, because the events for which it waits were
// written or cannot be written. The caller of this function must hold the mutex.
bool Chronicler::has_ready_caller() const {
  return std::any_of(waiting_.begin(), waiting_.end(), [this](const auto& one) { return one.first <= added_; });
}

Chronicler::Health Chronicler::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

void Chronicler::work(const std::stop_token& stop) {
  Time next_trim = os::now() + trim_interval;
  while (!stop.stop_requested()) {
    check_clock();
    write();
    if (os::now() >= next_trim) {
      writer_.trim();
      next_trim = os::now() + trim_interval;
    }
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, std::chrono::seconds(1), [this] { return has_ready_caller(); });
  }
}

void Chronicler::check_clock() {
  const std::int64_t at_ms = calendar_ms();
  const std::int64_t jump = clock_.check(at_ms, os::now());
  if (jump == 0) return;
  server_events_->add(
      {at_ms, "", "history",
       fmt::format("the clock jumped {} by {}: rows are deleted by age only after a day of rows with the new time",
                   jump > 0 ? "forward" : "back", rough_duration(std::abs(jump)))});
}

void Chronicler::write() {
  std::vector<HistoryWriter::Entry> seconds;
  for (const auto& watch : fleet_->all()) {
    for (const Second& second : watch->take_seconds()) seconds.push_back({watch->name(), second});
  }
  std::vector<ServerEvent> server_events;
  std::uint64_t added = 0;
  {
    const std::lock_guard lock(mutex_);
    server_events = std::exchange(unwritten_events_, {});
    added = added_;
  }
  writer_.write(seconds, server_events);
  for (std::string& note : writer_.take_notes()) server_events_->add({calendar_ms(), "", "history", std::move(note)});
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
