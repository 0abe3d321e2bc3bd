// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/encoder/pace.hpp"
#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::serve {

using namespace client;

namespace {

using namespace std::chrono_literals;

constexpr Time summary_interval = 1s;
constexpr Time failure_report_interval = 1s;  // minimum time between two events about failed readings
constexpr Time retry_pause = 5s;              // pause before the next attempt to read an encoder in state `ended`

// Converts a time of os::now to a time point of the steady clock, which is the same clock.
std::chrono::steady_clock::time_point to_time_point(Time time) {
  return std::chrono::steady_clock::time_point(std::chrono::duration_cast<std::chrono::steady_clock::duration>(time));
}

double place_of(const Sample& sample) {
  const Reading& reading = sample.reading;
  if (reading.unit_um > 0) return micrometres(sample.position, reading.unit_um) / 1000;
  return std::ldexp(360.0 * static_cast<double>(sample.position), -static_cast<int>(reading.singleturn_bits));
}

std::string trouble_text(const Trouble& trouble) {
  std::string words = fmt::format("{}: {}", text_of(trouble.error).name, trouble.message);
  if (!trouble.advice.empty()) words += fmt::format(". Try: {}", trouble.advice);
  return words;
}

}  // namespace

std::string_view name_of(State state) {
  constexpr std::array<std::string_view, 7> names{"opening", "live", "silent", "failing", "lost", "ended", "examined"};
  return names[static_cast<std::size_t>(state)];
}

Watch::Watch(std::string name, const EncoderAddress& address, double rate, Time offset, ServerEvents& server_events)
    : name_(std::move(name)),
      address_(address),
      rate_(rate),
      offset_(offset),
      server_events_(&server_events),
      current_since_(os::now()),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

Watch::~Watch() {
  thread_.request_stop();
  wait();
}

void Watch::wait() {
  if (thread_.joinable()) thread_.join();
  {
    const std::lock_guard lock(mutex_);
    has_ended_ = true;
  }
  refuse_order("it was not done: the server no longer reads this encoder");
}

void Watch::refuse_order(const std::string& why) {
  std::optional<Order> left;
  {
    const std::lock_guard lock(mutex_);
    left = std::exchange(order_, std::nullopt);
  }
  if (!left) return;
  left->done({false, why, {}, left->changes_encoder() ? ChangeState::not_sent : ChangeState::none});
}

State Watch::state_now(Time age) const {
  const Time period = rate_ > 0 ? Time(static_cast<std::int64_t>(1e9 / rate_)) : Time{};
  const bool old = age > std::max<Time>(3 * period, 500ms);
  return current_.state == State::live && old ? State::silent : current_.state;
}

Snapshot Watch::snapshot() const {
  const std::int64_t now_s = calendar_ms() / 1000;
  const std::lock_guard lock(mutex_);
  Snapshot snapshot = current_;
  snapshot.age = os::now() - current_since_;
  snapshot.state = state_now(snapshot.age);
  snapshot.errors_last_minute = series_.errors_last_minute(now_s);
  return snapshot;
}

Details Watch::details() const {
  const std::lock_guard lock(mutex_);
  return details_;
}

void Watch::trace(bool on) {
  const std::lock_guard lock(mutex_);
  series_.trace(on);
}

std::vector<Point> Watch::take_points() {
  const std::lock_guard lock(mutex_);
  return series_.take_points();
}

std::vector<Point> Watch::recent_points() const {
  const std::lock_guard lock(mutex_);
  return series_.recent_points();
}

Outbox::Taken Watch::take_outgoing(Outlet outlet) {
  const std::lock_guard lock(mutex_);
  return outboxes_[static_cast<std::size_t>(outlet)].take();
}

void Watch::stop_outgoing(Outlet outlet) {
  const std::lock_guard lock(mutex_);
  outboxes_[static_cast<std::size_t>(outlet)].close();
}

std::vector<Second> Watch::last_minute() const {
  const std::lock_guard lock(mutex_);
  return series_.last_minute();
}

std::vector<Second> Watch::take_seconds() {
  const std::lock_guard lock(mutex_);
  return series_.take_seconds(calendar_ms() / 1000);
}

std::string Watch::acknowledge(std::string_view alarm, const std::string& token, const std::string& who) {
  {
    const std::lock_guard lock(mutex_);
    std::vector<std::string_view> names;
    bool is_raised = false;
    for (RaisedAlarm& one : current_.raised) {
      names.push_back(one.name);
      if (one.name != alarm) continue;
      is_raised = true;
      one.acknowledged_by = token;
      one.acknowledged_ms = calendar_ms();
    }
    if (!is_raised) return fmt::format("the alarm \"{}\" is not raised{}", alarm, suggestion(alarm, names));
  }
  add_event("acknowledged", std::string(alarm), who);
  return "";
}

std::string_view Watch::give(Order order) {
  const std::lock_guard lock(mutex_);
  if (has_ended_) return "the server no longer reads this encoder";
  if (is_examining_) return "the encoder is being examined: try again afterwards";
  if (order_) return "another order for this encoder is waiting: try again when it is done";
  order_ = std::move(order);
  changed_.notify_all();
  return "";
}

void Watch::accept_orders(bool on) {
  const std::lock_guard lock(mutex_);
  is_examining_ = !on;
}

void Watch::add_event(std::string_view kind, std::string text, std::string who) {
  server_events_->add({calendar_ms(), name_, std::string(kind), std::move(text), std::move(who)});
}

void Watch::work(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    try {
      read_on(stop);
    } catch (const os::Interrupted&) {  // the program ends; os::interrupted() also stops the other threads
      return;
    } catch (const os::Ended&) {  // the reading thread was requested to end during a wait
      return;
    } catch (const std::exception& error) {
      set_state(State::ended, error.what());
      refuse_order(error.what());
    }
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, stop, to_time_point(os::now() + retry_pause), [&] { return order_.has_value(); });
  }
}

void Watch::read_on(const std::stop_token& stop) {
  Pace pace(rate_, offset_);
  Encoder live = client::make_encoder(address_, pace.period());
  live.end_when([&] { return stop.stop_requested() && !command_runs_; });
  Time next = os::now() + offset_;
  const auto read = [&] {
    publish(live, live.next());
    next = pace.next();
  };
  // If a reading is due, reads the position between two requests of a long order.
  const auto between = [&] {
    if (os::now() < next) return;
    read();
    if (!live.connected()) throw os::Failure(os::Failure::Kind::lost, "the port was lost meanwhile");
  };
  while (!stop.stop_requested()) {
    std::optional<Order> order;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_until(lock, stop, to_time_point(next), [&] { return order_.has_value(); });
      order = std::exchange(order_, std::nullopt);
    }
    if (order) {
      carry_out(live, *order, between, stop);
    } else if (!stop.stop_requested()) {
      read();
    }
  }
}

void Watch::set_state(State state, const std::string& message) {
  bool had_reading = false;
  const bool is_new = [&] {
    const std::lock_guard lock(mutex_);
    had_reading = current_.has_reading;
    const bool changed = current_.state != state || (state == State::ended && current_.message != message);
    current_.state = state;
    current_.message = message;
    return changed;
  }();
  if (!is_new) return;
  if (state == State::failing) {
    if (os::now() < next_failure_report_) return;
    next_failure_report_ = os::now() + failure_report_interval;
  }
  if (state != State::live) return add_event(name_of(state), message);
  add_event("back", had_reading ? "readings arrive again" : "readings arrive");
}

void Watch::publish(const Encoder& live, const Sample& sample) {
  switch (sample.kind) {
    case Sample::Kind::reading: {
      {
        const std::lock_guard lock(mutex_);
        current_.has_reading = true;
        current_.last = sample;
        if (sample.position_valid) current_.place = place_of(sample);
        current_since_ = sample.at;
        ++current_.readings;
      }
      set_state(State::live, "");
      if (sample.restarted && !restarted_) add_event("restarted", sample.message);
      restarted_ = sample.restarted;
      report_alarms(sample.reading);
      break;
    }
    case Sample::Kind::failed:
      set_state(State::failing, trouble_text(sample.trouble));
      break;
    case Sample::Kind::lost:
      set_state(State::lost, sample.message);
      break;
    case Sample::Kind::absent: {
      const std::lock_guard lock(mutex_);
      current_.message = sample.message;
      break;
    }
    case Sample::Kind::back:
      break;
  }
  summarize(live, sample);
}

void Watch::summarize(const Encoder& live, const Sample& sample) {
  const Connection& encoder = connection_of(live);
  const std::uint64_t bad = encoder.counters().bad();
  const Time now = os::now();
  const std::lock_guard lock(mutex_);
  const std::uint64_t before = current_.counters.bad();
  // The counters of errors start at 0 again when the encoder was opened again.
  const std::uint64_t errors = bad < before ? bad : bad - before;
  const std::int64_t at_ms = calendar_ms();
  series_.count_errors(at_ms, errors);
  if (sample.kind == Sample::Kind::reading) {
    series_.count_reading(at_ms, sample.position_valid ? std::optional(place_of(sample)) : std::nullopt,
                          sample.measured_speed());
  }
  queue_outgoing(sample);
  if (errors != 0) details_.bad = live.bad_exchanges();
  current_.counters = encoder.counters();
  current_.losses = live.losses();
  current_.restarts = live.restarts();
  if (now < next_summary_) return;
  next_summary_ = now + summary_interval;
  if (sample.kind == Sample::Kind::reading) {
    AnswerSink sink;
    encoder.report(sink);
    details_.fields = to_json(sink.answer.row());
    details_.reply = shown_values(sink.answer);
  }
  current_.rate = live.rate();
  const host::Latencies& latencies = encoder.latencies();
  current_.latency = {latencies.percentile(0.5),        latencies.percentile(0.99), latencies.longest(),
                      latencies.within(latency_limits), latencies.count(),          latencies.sum()};
}

void Watch::queue_outgoing(const Sample& sample) {
  const auto is_wanted = [](const Outbox& one) { return one.wanted(); };
  if (sample.kind != Sample::Kind::reading || std::none_of(outboxes_.begin(), outboxes_.end(), is_wanted)) return;
  const Reading& reading = sample.reading;
  OutgoingReading outgoing;
  outgoing.at_us = calendar_us() - std::chrono::duration_cast<std::chrono::microseconds>(os::now() - sample.at).count();
  if (sample.position_valid) outgoing.place = place_of(sample);
  outgoing.speed = sample.measured_speed();
  const client::JointAngles& angles = sample.angles;
  outgoing.joint = angles.joint_mm ? angles.joint_mm : angles.joint_deg;
  outgoing.joint_speed = angles.joint_speed_mm_s ? angles.joint_speed_mm_s : angles.joint_speed_rpm;
  outgoing.electrical_deg = angles.electrical_deg;
  if (reading.ready && reading.singleturn_valid()) outgoing.counts = reading.singleturn;
  if (reading.multiturn_bits != 0 && reading.multiturn_valid) outgoing.turns = reading.turns();
  for (Outbox& outbox : outboxes_) {
    if (outbox.wanted()) outbox.put(outgoing);
  }
}

// An alarm counts as raised until a reading reports it as clear.
void Watch::report_alarms(const Reading& reading) {
  const std::uint32_t alarms = reading.alarms | (alarms_ & ~reading.alarms_reported);
  if (alarms == alarms_) return;
  const Unit& unit = *address_.unit;
  Reading before = reading;
  Reading after = reading;
  before.alarms = std::exchange(alarms_, alarms);
  after.alarms = alarms;
  const std::vector<Flags> then = alarms_of(unit, before);
  const std::vector<Flags> now = alarms_of(unit, after);
  for (std::size_t channel = 0; channel < now.size(); ++channel) {
    const FieldInfo& field = *now[channel].field;
    const std::uint32_t changed = then[channel].bits ^ now[channel].bits;
    for (std::size_t bit = 0; bit < field.flags.size(); ++bit) {
      const FlagInfo& flag = field.flags[bit];
      if ((changed >> bit & 1) == 0 || flag.name.empty()) continue;
      const bool raised = (now[channel].bits >> bit & 1) != 0;
      std::string words =
          fmt::format("{}{}: {}", now.size() > 1 ? fmt::format("{} ", field.name) : "", flag.name, flag.meaning);
      if (raised && !flag.action.empty()) words += fmt::format(". What to do: {}", flag.action);
      {
        const std::lock_guard lock(mutex_);
        std::erase_if(current_.raised,
                      [&](const RaisedAlarm& one) { return one.channel == field.name && one.name == flag.name; });
        if (raised) current_.raised.push_back({field.name, flag.name, calendar_ms(), {}, 0});
      }
      add_event(raised ? "alarm" : "alarm_over", words);
    }
  }
}

// Carries out an order. Commands and examinations are also reported by an event.
void Watch::carry_out(Encoder& live, const Order& order, const std::function<void()>& between,
                      const std::stop_token& stop) {
  const std::string_view name = order.name();
  const bool is_examination = order.kind == Order::Kind::examination;
  const bool is_reported = is_examination || order.kind == Order::Kind::command;
  OrderResult done;
  bool has_begun = false;
  const auto note = [&](const std::exception& failure) {
    if (const Change* change = change_of(failure)) done.change = change->state;
  };
  const auto finish = [&] {
    if (order.changes_encoder() && done.change == ChangeState::none) done.change = ChangeState::not_sent;
    if (done.good && done.change != ChangeState::none && !live.change().note.empty()) {
      done.text += fmt::format("; {}", live.change().note);
    }
    command_runs_ = false;
    accept_orders(true);
    if (is_reported) add_event("command", done.text, order.who);
    order.done(done);
  };
  const auto end = [&](std::string_view advice) {
    done.text = fmt::format("{} was interrupted, because the server is shutting down or no longer reads this encoder{}",
                            name, advice);
    finish();
  };
  command_runs_ = order.kind == Order::Kind::command;
  accept_orders(!is_examination);
  try {
    if (!is_examination && !live.connected()) live.connect();
    has_begun = true;
    done = is_examination ? examine(live, stop) : serve::carry_out(live, order, between);
  } catch (const os::Failure& failure) {  // the port has failed; the next reading will find that the port is lost
    note(failure);
    done.text = fmt::format("{} {}: {}", name, has_begun ? "was interrupted" : "was not done", failure.what());
  } catch (const os::Interrupted& interrupted) {
    note(interrupted);
    end(command_runs_ ? ": read back whether it was done" : "");
    throw;
  } catch (const os::Ended& ended) {
    note(ended);
    end("");
    throw;
  } catch (const std::exception& error) {
    note(error);
    done.text = fmt::format("{} failed: {}", name, error.what());
  }
  if (order.changes_encoder()) live.forget_position();
  if (is_examination) reconnect(live);
  finish();
}

// Opening a virtual encoder again would create a new one, so its open port is used.
OrderResult Watch::examine(Encoder& live, const std::stop_token& stop) {
  const std::string words = "the encoder is being examined, readings continue afterwards";
  set_state(State::examined, words);
  const EncoderAddress address = connection_of(live).uri();
  Surroundings surroundings;
  if (address.port_kind == client::PortKind::sim) {
    if (!live.connected()) live.connect();
    surroundings.open = [&](const EncoderAddress&) { return connection_of(live).lend(); };
  } else {
    surroundings.on_the_clock = true;
    live.disconnect();
  }
  DoctorChoices choices;
  choices.progress = [&](const std::string& what) { set_state(State::examined, fmt::format("{}: {}", words, what)); };
  choices.over = [&] { return stop.stop_requested(); };
  const Examination examination = client::examine(address, choices, surroundings);
  return {true, fmt::format("doctor: {}", examination.verdict()), to_json(examination)};
}

void Watch::reconnect(Encoder& live) {
  if (live.connected()) return;
  try {
    live.connect();
  } catch (const os::Failure& failure) {
    set_state(State::lost, failure.what());
  }
}

}  // namespace absenc::serve
