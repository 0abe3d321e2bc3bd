// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/stream_port.hpp"

#include <algorithm>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

StreamPort::StreamPort() : waiting_(os::now()) {}

Time StreamPort::now() { return waiting_.now(); }

void StreamPort::begin(const ByteStep& step) {
  switch (step.kind) {
    case ByteStep::Kind::transfer:
      transfer(step);
      break;
    case ByteStep::Kind::pulse:
      reach(step.at);
      pulse(step);
      break;
    case ByteStep::Kind::configure:
      reach(sent_at_);  // bytes that are not sent yet must leave at the old rate
      change_rate(step.rate);
      break;
    case ByteStep::Kind::wait:
    case ByteStep::Kind::emit:
    case ByteStep::Kind::done:
      break;
  }
}

void StreamPort::transfer(const ByteStep& step) {
  // Most transfers are due already. The comparison with the time that the state machine knows shows this without
  // reading the clock.
  if (step.at > waiting_.known_time() + send_slack_ && step.at > os::now() + send_slack_) reach(step.at);
  std::span<const std::uint8_t> out = step.out;
  for (; step.frame != 0 && out.size() > step.frame; out = out.subspan(step.frame)) {
    write(out.first(step.frame));
    reach(sent_at_ + step.width);
  }
  write(out);
}

void StreamPort::write(std::span<const std::uint8_t> out) {
  const Time before = std::max(os::now(), sent_at_);
  if (!out.empty()) write_all(out);
  const Time after = leaving_ == Leaving::from_write ? before : std::max(os::now(), before);
  const Time duration = character_time_ * static_cast<std::int64_t>(out.size());
  const Time earliest = before + duration;
  const Time latest = leaving_ == Leaving::in_write ? std::max(after, earliest) : after + duration;
  mark_sent(latest, latest - earliest);
}

ByteEvent StreamPort::wait(const ByteStep& step) {
  const bool is_idle = waiting_.silence.has_received() && step.expect == 0;
  waiting_.begin(step, is_idle ? std::min(latency_, idle_latency_) : latency_);
  if (std::exchange(sent_pending_, false)) {
    return waiting_.report({.kind = ByteEvent::Kind::sent, .at = sent_at_, .late = sent_late_});
  }
  for (;;) {
    const std::span<const int> ready = poller_.wait(std::min(waiting_.due(), end_));
    const Time time = os::now();
    if (time >= end_) throw Ended{};
    if (!ready.empty()) {
      // Received bytes are reported before a silence or a timer event: if this program was late, they may have
      // arrived in time.
      if (const std::size_t size = read_some(buffer_, ready); size > 0) {
        const Time at = std::max(time, sent_at_);  // an echo may be received before the computed end of sending
        waiting_.silence.received(at);
        return waiting_.report(
            {.kind = ByteEvent::Kind::received, .at = at, .items = {buffer_.data(), size}, .late = lateness()});
      }
    } else if (const std::optional<ByteEvent> event = waiting_.take_due(time)) {
      return *event;
    }
  }
}

void StreamPort::reach(Time time) {
  os::reach(std::min(time, end_));
  if (os::now() < time) throw Ended{};
}

void StreamPort::pulse(const ByteStep& step) {
  const Time before = os::now();
  drive(step.wire, true);
  try {
    reach(os::now() + pulse_width(step.wire, step.width));
  } catch (...) {
    drive(step.wire, false);
    throw;
  }
  drive(step.wire, false);
  const Time after = os::now();
  mark_sent(after, after - before);
}

void StreamPort::mark_sent(Time at, Time late) {
  sent_at_ = at;
  sent_late_ = late;
  sent_pending_ = true;
  waiting_.silence.sent(at);
}

void StreamPort::drive(ExtraWire, bool) {
  throw Failure(Failure::Kind::unsupported, "this kind of port has no trigger and clear wires: use a serial port");
}

Time StreamPort::pulse_width(ExtraWire, Time requested) const { return requested; }

void StreamPort::change_rate(std::uint32_t rate) {
  throw Failure(Failure::Kind::unsupported,
                "this kind of port cannot change to " + std::to_string(rate) + " baud: use a serial port");
}

}  // namespace absenc::os
