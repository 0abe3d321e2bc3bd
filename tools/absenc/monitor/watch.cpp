// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/monitor/watch.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "absenc/client/encoder/pace.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/reading_text.hpp"

namespace absenc::tool {

using namespace client;

namespace {

using namespace std::chrono_literals;

constexpr std::size_t most_lines = 200;
constexpr Time between_summaries = 100ms;
// Shortest time between two good readings that are listed in the trace, unless the alarms change.
constexpr Time between_lines = 200ms;

// Converts a time of os::now to the type that functions of the standard library take.
std::chrono::steady_clock::time_point to_time_point(Time time) {
  return std::chrono::steady_clock::time_point(std::chrono::duration_cast<std::chrono::steady_clock::duration>(time));
}

/// Collects the fields of the last reply that are not in the line of text about the reading.
class OtherFields final : public FieldSink {
 public:
  explicit OtherFields(const Unit& unit) : unit_(&unit) {}

  void put(const FieldValue& value) override {
    const FieldInfo& info = *value.info;
    // The flags of an encoder with two channels are too long for the line about the reading, so they are listed as
    // fields.
    const FieldInfo* in_line = unit_->alarms != nullptr ? unit_->alarms : unit_->status;
    const bool is_in_line = &info == in_line && unit_->second_status == nullptr && unit_->second_alarms == nullptr;
    const bool is_exchange = info.role == Role::exchange;  // the field only repeats a part of the request
    if (is_in_line || is_exchange || info.role == Role::position || info.role == Role::turns) return;
    const std::string shown = fmt::format("{}{}{}", to_text(value), info.unit.empty() ? "" : " ", info.unit);
    fields_.emplace_back(info, shown);
  }
  void put_reading(const Reading& reading) override { reading_ = reading; }

  [[nodiscard]] std::vector<std::string> texts() const {
    std::vector<std::string> texts;
    for (const auto& [info, shown] : fields_)
      texts.push_back(fmt::format("{} {}", info.name, marked(info, shown, reading_)));
    return texts;
  }

 private:
  const Unit* unit_;
  std::vector<std::pair<FieldInfo, std::string>> fields_;
  Reading reading_{};
};

}  // namespace

std::string_view name_of(Snapshot::State state) {
  static constexpr std::array<std::string_view, 7> names{"opening", "live",   "silent", "failing",
                                                         "lost",    "paused", "ended"};
  return names[static_cast<std::size_t>(state)];
}

Watch::Watch(std::string name, const EncoderAddress& uri, double rate, Time offset)
    : name_(std::move(name)),
      uri_(uri),
      rate_(rate),
      offset_(offset),
      start_(os::now()),
      known_at_(start_),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

void Watch::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

Snapshot Watch::snapshot(bool details) const {
  const std::lock_guard lock(mutex_);
  Snapshot snapshot = known_;
  snapshot.age = os::now() - known_at_;
  const Time period = rate_ > 0 ? Time(static_cast<std::int64_t>(1e9 / rate_)) : Time{};
  const bool old = snapshot.age > std::max<Time>(3 * period, 500ms);
  if (snapshot.state == Snapshot::State::live && old) snapshot.state = Snapshot::State::silent;
  if (paused_ && snapshot.state != Snapshot::State::ended) snapshot.state = Snapshot::State::paused;
  if (details) {
    snapshot.trace.assign(lines_.begin(), lines_.end());
  } else {
    snapshot.bad.clear();
    snapshot.fields.clear();
  }
  return snapshot;
}

void Watch::pause(bool paused) {
  const std::lock_guard lock(mutex_);
  paused_ = paused;
  changed_.notify_all();
}

void Watch::run(const Command& command) {
  const std::lock_guard lock(mutex_);
  command_ = command;
  known_.notice = fmt::format("{} is running", command.name);
  changed_.notify_all();
}

void Watch::notify(std::string text) {
  const std::lock_guard lock(mutex_);
  known_.notice = std::move(text);
}

void Watch::work(const std::stop_token& stop) {
  try {
    Pace pace(rate_, offset_);
    Encoder live = make_encoder(uri_, pace.period());
    live.end_when([&] { return stop.stop_requested() && !command_runs_; });
    Time next = start_ + offset_;
    for (;;) {
      std::optional<Command> command;
      {
        std::unique_lock lock(mutex_);
        changed_.wait_until(lock, stop, to_time_point(next), [&] { return command_.has_value(); });
        if (paused_) changed_.wait(lock, stop, [&] { return !paused_ || command_.has_value(); });
        command = std::exchange(command_, std::nullopt);
      }
      if (stop.stop_requested()) return;
      if (command) {
        command_runs_ = true;
        run_command(live, *command);
        command_runs_ = false;
      } else {
        publish(live, live.next());
        next = pace.next();
      }
    }
    // a signal such as Ctrl-C has set os::interrupted(), at which every thread of the monitor ends
  } catch (const os::Interrupted&) {
  } catch (const os::Ended&) {  // the thread was asked to end while it waited on a line without pauses
  } catch (const std::exception& error) {
    end(error.what());
  }
}

void Watch::end(const std::string& why) {
  add_line(os::now(), why);
  const std::lock_guard lock(mutex_);
  known_.state = Snapshot::State::ended;
  known_.message = why;
}

void Watch::publish(const Encoder& live, const Sample& sample) {
  trace(live, sample);
  const Time now = os::now();
  const std::lock_guard lock(mutex_);
  switch (sample.kind) {
    case Sample::Kind::reading:
      known_.state = Snapshot::State::live;
      known_.has_reading = true;
      known_.last = sample;
      known_at_ = sample.at;
      ++known_.readings;
      break;
    case Sample::Kind::failed:
      known_.state = Snapshot::State::failing;
      known_.message = fmt::format("{}: {}", text_of(sample.trouble.error).name, sample.trouble.message);
      if (!sample.trouble.advice.empty()) known_.message += fmt::format(". Try: {}", sample.trouble.advice);
      if (!sample.trouble.finding.empty()) {
        known_.message += fmt::format(". {}", finding_line(sample.trouble, connection_of(live).uri()));
      }
      break;
    case Sample::Kind::lost:
      known_.state = Snapshot::State::lost;
      [[fallthrough]];
    case Sample::Kind::absent:
      known_.message = sample.message;
      break;
    case Sample::Kind::back:
      break;
  }
  const Connection& encoder = connection_of(live);
  if (encoder.counters().bad() != known_.counters.bad()) known_.bad = live.bad_exchanges();
  known_.counters = encoder.counters();
  known_.losses = live.losses();
  if (now < next_summary_ && sample.kind == Sample::Kind::reading) return;
  next_summary_ = now + between_summaries;
  if (sample.kind == Sample::Kind::reading) {
    OtherFields fields(encoder.unit());
    encoder.report(fields);
    known_.fields = fields.texts();
  }
  known_.restarts = live.restarts();
  known_.rate = live.rate();
  known_.median = encoder.latencies().percentile(0.5);
  known_.percentile_99 = encoder.latencies().percentile(0.99);
  known_.longest = encoder.latencies().longest();
}

void Watch::trace(const Encoder& live, const Sample& sample) {
  const Unit& unit = live.unit();
  switch (sample.kind) {
    case Sample::Kind::reading: {
      if (sample.restarted && !restarted_) add_line(sample.at, sample.message);
      restarted_ = sample.restarted;
      const Reading& reading = sample.reading;
      const bool other_alarms = reading.alarms != alarms_ || reading.alarms_reported != alarms_reported_;
      if (!other_alarms && sample.at < next_line_) return;
      alarms_ = reading.alarms;
      alarms_reported_ = reading.alarms_reported;
      next_line_ = sample.at + between_lines;
      return add_line(sample.at, reading_text(unit, reading, doubt_of(sample)));
    }
    case Sample::Kind::failed: {
      std::string text = fmt::format("{}: {}", text_of(sample.trouble.error).name, sample.trouble.message);
      if (!sample.trouble.exchange.empty()) text += fmt::format(" ({})", sample.trouble.exchange);
      return add_line(sample.at, text);
    }
    case Sample::Kind::lost:
    case Sample::Kind::back:
      return add_line(sample.at, sample.message);
    case Sample::Kind::absent:
      return;
  }
}

void Watch::add_line(Time at, const std::string& text) {
  const std::lock_guard lock(mutex_);
  lines_.push_back(fmt::format("{:9.3f}  {}", std::chrono::duration<double>(at - start_).count(), text));
  if (lines_.size() > most_lines) lines_.pop_front();
}

std::string Watch::result_of(Encoder& live, const Command& command) {
  Connection& connection = connection_of(live);
  if (!connection.connected()) return fmt::format("{}: not sent: the port is away", command.name);
  try {
    const Outcome outcome = connection.run(command, {});
    live.forget_position();
    if (outcome.error != Error::none) {
      return fmt::format("{} failed: {}", command.name, connection.trouble(outcome).message);
    }
    return fmt::format("{}: {}", command.name, outcome.change.text());
  } catch (const os::Failure& failure) {  // the port was lost during the command; the next reading reports the loss
    return fmt::format("{} was broken off, read whether it was done: {}", command.name, failure.what());
  }
}

void Watch::run_command(Encoder& live, const Command& command) {
  const std::string notice = result_of(live, command);
  add_line(os::now(), notice);
  const std::lock_guard lock(mutex_);
  known_.notice = notice;
  known_.counters = live.counters();
}

}  // namespace absenc::tool
