// SPDX-License-Identifier: Apache-2.0
// Listens to an open link and reads over it, each time once, and keeps all that was seen.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>

#include "absenc/client/doctor/observations.hpp"
#include "absenc/client/way/link.hpp"
#include "absenc/host/session.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

template <class Item>
class Examiner {
 public:
  /// All waiting ends with os::Ended from the moment on in which `over` is true; empty: never.
  Examiner(const EncoderAddress& address, Link link, std::function<bool()> over)
      : address_(address),
        link_(std::move(link)),
        over_(std::move(over)),
        storage_(std::make_unique<std::byte[]>(address.unit->host_storage)),
        session_(*address.unit, address.options, port_, {storage_.get(), address.unit->host_storage}, address.echo, 1) {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      port_.attach(*link_.frames);
    } else {
      port_.attach(*link_.bytes);
    }
    port_.abort = [this] { return session_.abort(); };
    port_.over = over_;
  }

  /// What comes though nothing is asked, in pieces of the time.
  void listen(Observations& seen) {
    if constexpr (!std::is_same_v<Item, CanFrame>) {
      unsigned busy = 0;
      for (unsigned piece = 0; piece < pieces; ++piece) busy += hear(seen.unasked, piece_time) ? 1 : 0;
      seen.listened = pieces * piece_time;
      seen.never_silent = busy + 1 >= pieces;
    }
  }

  /// What comes when all was given up: one that answers later than anybody waited for.
  void listen_for_late(Observations& seen) {
    if constexpr (!std::is_same_v<Item, CanFrame>) {
      std::vector<std::uint8_t> came;
      hear(came, pieces * piece_time);
      if (came.empty()) return;
      ++seen.late;
      seen.lateness = std::max(seen.lateness, port_.received_at - port_.sent_at);
    }
  }

  /// Up to `count` readings within `limit`; fewer when nobody answers at all. Throws as the port.
  void read(const Command& command, std::size_t count, Time limit, std::vector<Attempted>& into) {
    const Time end = port_.now() + limit;
    // On a line that is never silent. Not by the port's clock: to ask for it between a step and its wait lets the time
    // of the step pass.
    port_.over = [this, last = os::now() + 2 * limit] { return os::now() > last || is_over(); };
    std::size_t good = 0;
    for (std::size_t i = 0; i < count && port_.now() < end; ++i) {
      const auto unheard = [](const Attempted& one) { return !one.heard; };
      if (i >= most_silent && good == 0 && std::all_of(into.begin(), into.end(), unheard)) break;
      if (i >= most_bad && good == 0) break;
      try {
        into.push_back(read_once(command));
      } catch (const os::Ended&) {
        if (is_over()) throw;
        break;
      }
      good += into.back().error == Error::none ? 1 : 0;
    }
    port_.over = over_;
  }

  /// Fields of another command that only reads. Throws as the port.
  void report(const Command& command, Arguments arguments, FieldSink& sink) {
    const Conversation<Item>* conversation = session_.run(command, arguments);
    if (conversation != nullptr && conversation->error() == Error::none) conversation->report(sink);
  }

  void conclude(Observations& seen) const {
    seen.line_errors += port_.line_errors;
    seen.late = std::max(seen.late, session_.counters().late);
    seen.lateness = std::max(seen.lateness, session_.lateness());
  }

 private:
  static constexpr unsigned pieces = 5;
  static constexpr Time piece_time = std::chrono::milliseconds(20);
  static constexpr std::size_t most_silent = 8;  // requests in vain, until nobody is there
  static constexpr std::size_t most_bad = 24;    // without a good one
  static constexpr std::size_t most_heard = 4096;

  [[nodiscard]] bool is_over() const { return over_ && over_(); }

  // Whether anything came.
  bool hear(std::vector<std::uint8_t>& into, Time time) {
    const std::size_t before = into.size();
    const Step<Item> step{.at = port_.now() + time};
    for (;;) {
      const Event<Item> event = port_.wait(step);
      if (event.kind == Event<Item>::Kind::timer || event.at >= step.at) break;
      if constexpr (!std::is_same_v<Item, CanFrame>) {
        if (into.size() < most_heard) into.insert(into.end(), event.items.begin(), event.items.end());
      }
    }
    return into.size() != before;
  }

  Attempted read_once(const Command& command) {
    port_.sent.clear();
    port_.received.clear();
    const Conversation<Item>* conversation = session_.run(command);
    Attempted one;
    if (conversation == nullptr) {
      one.error = Error::unsupported;
      return one;
    }
    one.error = conversation->error();
    one.detail = conversation->detail();
    one.advice = conversation->advice();
    one.heard = !port_.received.empty();
    if (one.error == Error::none && conversation->reading() != nullptr) one.reading = *conversation->reading();
    keep_exchange(one);
    return one;
  }

  void keep_exchange(Attempted& one) const {
    const auto limit = [this](std::size_t items) {
      return port_.answer + static_cast<std::int64_t>(items) * address_.line.with_some_rate().character();
    };
    one.after = port_.received_at - port_.sent_at;
    one.allowed = limit(port_.received.size());
    if constexpr (std::is_same_v<Item, CanFrame>) {
      if (!port_.sent.empty()) one.exchange.request.can = port_.sent.front();
      if (!port_.received.empty()) one.exchange.reply.can = port_.received.back();
    } else {
      one.raw = port_.received;
      one.exchange.request.bytes = port_.sent;
      one.exchange.reply.bytes = port_.received;
      one.exchange.reply.bits = std::min(port_.clocks, port_.received.size() * 8);
      auto& reply = one.exchange.reply.bytes;
      if (is_echoed()) reply.erase(reply.begin(), reply.begin() + static_cast<std::ptrdiff_t>(port_.sent.size()));
    }
  }

  // A reply may begin as its request does: what is a whole frame as it came has no echo before it.
  [[nodiscard]] bool is_echoed() const {
    const Bytes sent = port_.sent;
    const Bytes came = port_.received;
    const bool repeats =
        !sent.empty() && came.size() > sent.size() && std::equal(sent.begin(), sent.end(), came.begin());
    if (!repeats || session_.echo().mode() != host::EchoMode::automatic) {
      return repeats && session_.echo().mode() == host::EchoMode::on;
    }
    const auto is_frame = [this](Bytes bytes) {
      const FrameEnd end = address_.unit->frame_end(address_.options, Direction::reply, bytes);
      return end.kind == FrameEnd::Kind::complete && end.size == bytes.size();
    };
    return !is_frame(came) && is_frame(came.subspan(sent.size()));
  }

  EncoderAddress address_;
  Link link_;
  std::function<bool()> over_;
  WatchedPort<Item> port_;
  std::unique_ptr<std::byte[]> storage_;
  host::Session<Item> session_;
};

}  // namespace absenc::client
