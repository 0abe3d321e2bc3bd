// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt_collector.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/mqtt_messages.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::size_t most_in_a_message = 250;  // greatest number of readings in a message, about 15 kB
// Shortest time between two events about dropped readings; the events need room in the spool, too.
constexpr Time drop_report_interval = std::chrono::seconds(10);
// time for which the health of MQTT mentions dropped readings
constexpr Time drop_display_time = std::chrono::seconds(30);

}  // namespace

MqttCollector::MqttCollector(const MqttSettings& settings, Spool& spool, const Fleet& fleet,
                             ServerEvents& server_events)
    : settings_(&settings),
      spool_(&spool),
      fleet_(&fleet),
      server_events_(&server_events),
      next_id_(spool.next_id()),
      next_numbers_(spool.next_numbers()),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

MqttCollector::~MqttCollector() {
  thread_.request_stop();
  thread_.join();
  collect();
}

void MqttCollector::add(const std::vector<ServerEvent>& server_events) {
  const std::lock_guard lock(mutex_);
  // The acknowledgement of an alarm is not published: subscribers receive the alarm itself.
  std::copy_if(server_events.begin(), server_events.end(), std::back_inserter(waiting_),
               [](const ServerEvent& one) { return one.kind != "acknowledged"; });
}

MqttCollector::Figures MqttCollector::figures() const {
  const std::lock_guard lock(mutex_);
  Figures figures = figures_;
  figures.drops = figures.dropped != 0 && os::now() - last_dropped_ < drop_display_time;
  return figures;
}

void MqttCollector::work(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const Time due = os::now() + settings_->batch;
    collect();
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, std::max<Time>(due - os::now(), Time{}), [] { return false; });
  }
}

// Returns the message id that subscribers see: the number in the spool, behind a random text that changes each time
// the spool is opened. The number alone is not unique, because after a power failure the spool may use it again.
std::string MqttCollector::id_text(std::int64_t id) const { return fmt::format("{}-{}", spool_->run(), id); }

void MqttCollector::collect() {
  std::vector<Message> messages;
  std::map<std::string, std::uint64_t> changed;
  for (const auto& watch : fleet_->all()) {
    Outbox::Taken taken = watch->take_outgoing(Watch::Outlet::mqtt);
    if (taken.dropped != 0) {
      next_numbers_.try_emplace(watch->name(), 1).first->second += taken.dropped;
      note_dropped({0, taken.dropped}, "the disk was too slow");
    }
    if (taken.readings.empty()) continue;
    collect_readings(*watch, std::move(taken.readings), messages);
    changed[watch->name()] = next_numbers_[watch->name()];
  }
  std::vector<ServerEvent> server_events;
  {
    const std::lock_guard lock(mutex_);
    server_events = std::exchange(waiting_, {});
  }
  for (const ServerEvent& one : server_events) {
    const std::int64_t id = next_id_ + static_cast<std::int64_t>(messages.size());
    messages.push_back({id, topic_of(settings_->prefix, one.encoder, "event"), event_text(id_text(id), one), 0});
  }
  spool(messages, changed);
  if (unreported_.messages + unreported_.readings == 0 || os::now() < next_report_) return;
  next_report_ = os::now() + drop_report_interval;
  const Spool::Counts dropped = std::exchange(unreported_, {});
  server_events_->add({calendar_ms(), "", "mqtt",
                       fmt::format("{} readings in {} messages were dropped, the oldest first: {}", dropped.readings,
                                   dropped.messages, unreported_reason_)});
}

void MqttCollector::collect_readings(const Watch& watch, std::vector<OutgoingReading> readings,
                                     std::vector<Message>& messages) {
  const std::string topic = topic_of(settings_->prefix, watch.name(), "readings");
  std::uint64_t& next = next_numbers_.try_emplace(watch.name(), 1).first->second;
  for (std::span<const OutgoingReading> rest(readings); !rest.empty();) {
    const std::span<const OutgoingReading> piece = rest.first(std::min(rest.size(), most_in_a_message));
    const std::int64_t id = next_id_ + static_cast<std::int64_t>(messages.size());
    messages.push_back({id, topic, readings_text(id_text(id), watch, next, piece), piece.size()});
    next += piece.size();
    rest = rest.subspan(piece.size());
  }
}

void MqttCollector::spool(const std::vector<Message>& messages, const std::map<std::string, std::uint64_t>& changed) {
  spool_->add(messages, changed);
  next_id_ += static_cast<std::int64_t>(messages.size());
  for (const std::string& note : spool_->take_notes()) server_events_->add({calendar_ms(), "", "mqtt", note});
  const Spool::Dropped dropped = spool_->take_dropped();
  if (dropped.counts.messages != 0) note_dropped(dropped.counts, dropped.why);
  const Spool::Condition condition = spool_->condition();
  for (const auto& [name, next] : changed) not_on_disk_[name] = next - 1;
  const std::lock_guard lock(mutex_);
  figures_.trouble = condition.trouble;
  if (condition.in_memory) return;
  for (const auto& [name, number] : not_on_disk_) figures_.taken[name] = number;
  not_on_disk_.clear();
}

void MqttCollector::note_dropped(const Spool::Counts& dropped, const std::string& why) {
  unreported_.messages += dropped.messages;
  unreported_.readings += dropped.readings;
  unreported_reason_ = why;
  const std::lock_guard lock(mutex_);
  figures_.dropped += dropped.readings;
  last_dropped_ = os::now();
}

}  // namespace absenc::serve
