// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/slcan_port.hpp"

#include <algorithm>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

using LineEvent = slcan::LineReader::LineEvent;
using Kind = Failure::Kind;

namespace {

constexpr Time reply_timeout = 300ms;  // a USB adapter replies within 1 or 2 ms
constexpr Time settling_time = 20ms;
// greatest number of frames that the simulated adapter queues, as many as common adapters queue
constexpr std::size_t most_queued = 64;
// Limit of reads per call, so that a line that is never silent does not block the caller.
constexpr unsigned most_reads = 1024;

Bytes bytes_of(std::string_view text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

}  // namespace

// ---- SlcanLine

void SlcanLine::write(Bytes text) { bytes_->begin({.kind = ByteStep::Kind::transfer, .out = text}); }

void SlcanLine::collect(Time deadline) {
  received_any_ = false;
  deadline = reach(bytes_->now()) ? Time{} : std::min(deadline, due());
  // If the deadline is past, only bytes that have already arrived are read.
  const bool everything = deadline <= bytes_->now();
  for (unsigned reads = 0; reads < most_reads && (everything || !received_any_); ++reads) {
    const Time now = bytes_->now();
    // A byte port reports a timer event only for a time in the future.
    const ByteEvent event = bytes_->wait({.at = deadline <= now ? now + 1ns : deadline});
    if (event.kind == ByteEvent::Kind::timer) {
      if (!everything) reach(event.at);
      return;
    }
    if (event.kind != ByteEvent::Kind::received) continue;
    for (const std::uint8_t byte : event.items) {
      const LineEvent line_event = reader_.feed(byte);
      if (line_event == LineEvent::nothing) continue;
      received_any_ = true;
      handle_line(line_event, reader_.line(), event.at);
    }
  }
}

bool SlcanLine::receives_until(Time deadline) {
  collect(deadline);
  return received_any_;
}

// ---- SlcanPort

SlcanPort::SlcanPort(std::shared_ptr<Port<std::uint8_t>> bytes, std::string name, const LineSettings& settings)
    : SlcanLine(std::move(bytes)), name_(std::move(name)) {
  write(bytes_of("\r\r\r"));  // a carriage return ends any command that another program has begun
  settle();
  apply(settings);
}

SlcanPort::~SlcanPort() {
  try {
    write(bytes_of("C\r"));
  } catch (const Failure&) {  // the port may have disappeared; the adapter then stays open
  } catch (const Interrupted&) {
  } catch (const Ended&) {
  }
}

void SlcanPort::apply(const LineSettings& settings) {
  const auto code = slcan::rate_code(settings.rate);
  if (!code) {
    throw Failure(Kind::bad_rate, name_ + ": the adapter has no bit rate of " + std::to_string(settings.rate) +
                                      " bit/s: 10, 20, 50, 100, 125, 250, 500, 800 kbit/s and 1 Mbit/s are there");
  }
  static_cast<void>(request("C\r"));  // many adapters refuse the command to close if they are closed already
  settle();
  const std::string set{'S', static_cast<char>(*code), '\r'};
  const Reply rate = request(set);
  if (rate == Reply::refused) {
    throw Failure(Kind::bad_rate, name_ + ": the adapter refused a bit rate of " + std::to_string(settings.rate) +
                                      " bit/s (S" + static_cast<char>(*code) +
                                      "): does another program have it open? Unplug it and plug it in again");
  }
  const Reply open = request("O\r");
  if (open == Reply::refused) {
    throw Failure(Kind::system, name_ + ": the adapter refused to open the bus (O): unplug it and plug it in again");
  }
  if (rate == Reply::none && open == Reply::none && notes_.empty()) {
    notes_.push_back(name_ +
                     " does not acknowledge commands: some adapters never do; if nothing else comes, it may be no "
                     "slcan adapter, or need another baud");
  }
}

// The adapter's replies carry no number, so the replies to earlier commands are awaited before the next command is
// sent.
void SlcanPort::settle() {
  constexpr unsigned most_replies = 64;
  bool any = true;
  for (unsigned replies = 0; any && replies < most_replies; ++replies) {
    any = receives_until(os::now() + settling_time + latency());
  }
}

SlcanPort::Reply SlcanPort::request(std::string_view command) {
  collect(Time{});
  awaiting_reply_ = true;
  reply_ = Reply::none;
  write(bytes_of(command));
  const Time limit = os::now() + reply_timeout + latency();
  while (reply_ == Reply::none && os::now() < limit) collect(limit);
  awaiting_reply_ = false;
  return reply_;
}

void SlcanPort::send(const CanFrame& frame) { write(slcan::encode(frame)); }

void SlcanPort::handle_line(LineEvent line_event, Bytes line, Time at) {
  if (line_event == LineEvent::line && !line.empty() && slcan::begins_frame(line[0])) {
    if (const Result<CanFrame> frame = slcan::decode(line)) {
      push(*frame, at);
    } else {
      ++garbage_;
    }
  } else if (line_event == LineEvent::garbage) {
    ++garbage_;
  } else if (awaiting_reply_ && (line_event == LineEvent::refused || line.empty())) {
    reply_ = line_event == LineEvent::refused ? Reply::refused : Reply::accepted;
  } else if (line_event == LineEvent::refused) {
    push_error(at);  // the adapter refused a frame
  }
}

// ---- SlcanAdapter

void SlcanAdapter::send_reply(std::string_view text) { write(bytes_of(text)); }

void SlcanAdapter::send(const CanFrame& frame) {
  if (!connected()) {
    ++lost_;
    return;
  }
  bus_free_ = std::max(bus_free_, os::now()) + duration(frame);
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(os::now()).count() % 60'000;
  write(with_time_ ? slcan::encode(frame, static_cast<std::uint16_t>(milliseconds)) : slcan::encode(frame));
}

void SlcanAdapter::handle_line(LineEvent line_event, Bytes line, Time at) {
  if (line_event == LineEvent::garbage || line_event == LineEvent::refused) {
    ++garbage_;
    return;
  }
  if (line.empty()) return send_reply("\r");
  if (slcan::begins_frame(line[0])) return queue_frame(line, at);
  if (!execute(line)) send_reply("\a");
}

void SlcanAdapter::queue_frame(Bytes line, Time at) {
  const Result<CanFrame> frame = slcan::decode(line);
  if (!frame) ++garbage_;
  if (!frame || !open_ || listen_only_) return send_reply("\a");
  if (waiting_.size() == most_queued) {
    ++overflowed_;
    return send_reply("\a");
  }
  send_reply(frame->extended ? "Z\r" : "z\r");
  if (!connected()) {
    ++lost_;
    return;
  }
  if (waiting_.empty()) bus_free_ = std::max(bus_free_, at) + duration(*frame);
  waiting_.push_back(*frame);
}

// Reports at most one frame of the host per call, so that the device can send a frame between two frames of the host.
bool SlcanAdapter::reach(Time now) {
  if (waiting_.empty() || bus_free_ > now) return false;
  push(waiting_.front(), bus_free_);
  waiting_.pop_front();
  if (!waiting_.empty()) bus_free_ += duration(waiting_.front());
  return true;
}

// Returns the duration of `frame` on the bus, without stuff bits.
Time SlcanAdapter::duration(const CanFrame& frame) const {
  const std::int64_t bits = (frame.extended ? 67 : 47) + (frame.remote ? 0 : 8 * frame.size);
  return Time(std::chrono::seconds(1)) * bits / std::max<std::int64_t>(1, rate_);
}

// Executes a command of the host. Returns false if the adapter must refuse it.
bool SlcanAdapter::execute(Bytes line) {
  const auto letter = static_cast<char>(line[0]);
  switch (letter) {
    case 'S': {
      const std::uint32_t rate = line.size() == 2 ? slcan::rate_of(line[1]) : 0;
      if (open_ || rate == 0) return false;
      rate_ = rate;
      break;
    }
    case 'O':
    case 'L':
      if (open_ || rate_ == 0) return false;
      open_ = true;
      listen_only_ = letter == 'L';
      break;
    case 'C':
      if (!open_) return false;
      open_ = false;
      break;
    case 'Z':
      if (open_ || line.size() != 2) return false;
      with_time_ = line[1] == '1';
      break;
    case 'V':
      send_reply("V1013\r");
      return true;
    case 'N':
      send_reply("N0001\r");
      return true;
    case 'F':
      if (!open_) return false;
      send_reply("F00\r");
      return true;
    // bit timing registers, acceptance code and mask: accepted while the adapter is closed, but without effect
    case 's':
    case 'M':
    case 'm':
      if (open_) return false;
      break;
    default:
      ++garbage_;
      return false;
  }
  send_reply("\r");
  return true;
}

}  // namespace absenc::os
