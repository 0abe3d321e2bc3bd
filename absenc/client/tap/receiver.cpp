// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/tap/receiver.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "absenc/client/port/realtime.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/input.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

using namespace std::chrono_literals;

Receiver::Receiver(const EncoderAddress& uri) : link_(open_receiving(uri)), place_(link_.place) {
  check_realtime({&uri, 1});
}

Receiver::Receiver() : place_("standard input") {
  link_.latency = 20ms;  // assumed delay of bytes that another program writes to standard input, on a busy computer
}

Receiver::~Receiver() { cancel(); }

// Returns a duration of silence that no frame contains, although a busy computer may delay a part of a frame for longer
// than the latency of the link.
Time Receiver::quiet() const { return 500ms + 2 * link_.latency; }

void Receiver::start(Time end) {
  end_time_ = end;
  is_over_ = [this] {
    const std::lock_guard lock(mutex_);
    return cancelled_;
  };
  thread_ = std::jthread([this] { receive(); });
}

void Receiver::cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  changed_.notify_all();
}

Receiver::ReceiveEnd Receiver::end() const {
  const std::lock_guard lock(mutex_);
  return end_;
}
std::string Receiver::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}
std::uint64_t Receiver::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::optional<Received> Receiver::next(Time deadline) {
  std::unique_lock lock(mutex_);
  const auto has_something = [this] { return cancelled_ || !waiting_.empty() || end_ != ReceiveEnd::none; };
  constexpr Time longest = 1h;
  for (;;) {
    const Time patience =
        std::min({deadline == never ? longest : deadline - os::now(), os::CancelCheck::interval(), longest});
    if (changed_.wait_for(lock, std::max(patience, Time{}), has_something)) break;
    if (os::now() >= deadline) return std::nullopt;
    os::CancelCheck::check();
  }
  if (cancelled_ || waiting_.empty()) return std::nullopt;
  Received first = std::move(waiting_.front());
  waiting_.pop_front();
  waiting_size_ -= first.bytes.size();
  return first;
}

// ---- Functions of the receiving thread

void Receiver::receive() {
  const os::CancelCheck cancel_check(is_over_);
  try {
    if (link_.bytes != nullptr) {
      receive_from_port();
    } else {
      receive_from_input();
    }
  } catch (const os::Ended&) {
    finish(ReceiveEnd::time);
  } catch (const os::Interrupted&) {
    finish(ReceiveEnd::interrupted);
  } catch (const std::exception& failure) {
    finish(ReceiveEnd::lost, failure.what());
  }
}

// Receives bytes, and reports silence.
void Receiver::receive_from_port() {
  require_realtime(link_.realtime);
  Time quiet_at = link_.bytes->now() + quiet();
  for (;;) {
    const ByteEvent event = link_.bytes->wait({.at = std::min(quiet_at, end_time_)});
    if (event.kind == ByteEvent::Kind::received) {
      put({event.at, {event.items.begin(), event.items.end()}});
      quiet_at = event.at + quiet();
    } else if (event.kind == ByteEvent::Kind::timer) {
      if (event.at >= quiet_at) put({event.at, {}});
      quiet_at = event.at + quiet();
    }
    if (event.at >= end_time_) throw os::Ended{};
  }
}

void Receiver::receive_from_input() {
  std::array<std::uint8_t, 4096> buffer;
  Time quiet_at = os::now() + quiet();
  for (;;) {
    const std::optional<std::size_t> size = os::read_standard_input(buffer, std::min(quiet_at, end_time_));
    const Time now = os::now();
    if (size && *size == 0) return finish(ReceiveEnd::input);
    if (size) {
      put({now, {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*size)}});
    } else if (now >= quiet_at) {
      put({now, {}});
    }
    if (!size && now >= end_time_) throw os::Ended{};
    quiet_at = now + quiet();
  }
}

void Receiver::put(Received received) {
  const std::lock_guard lock(mutex_);
  if (waiting_size_ + received.bytes.size() > most_waiting) {
    dropped_ += received.bytes.size();
    return;
  }
  waiting_size_ += received.bytes.size();
  waiting_.push_back(std::move(received));
  changed_.notify_all();
}

void Receiver::finish(ReceiveEnd end, const std::string& problem) {
  const std::lock_guard lock(mutex_);
  end_ = end;
  problem_ = problem;
  changed_.notify_all();
}

}  // namespace absenc::client
