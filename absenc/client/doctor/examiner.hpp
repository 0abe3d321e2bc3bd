// SPDX-License-Identifier: Apache-2.0
// Listens to an open link and reads over it, each time once, and keeps all that was seen.
#pragma once

#include <algorithm>
#include <functional>
#include <utility>

#include "absenc/client/doctor/exchange_log.hpp"
#include "absenc/client/doctor/observations.hpp"
#include "absenc/client/port/link.hpp"
#include "absenc/client/port/runner.hpp"

namespace absenc::client {

template <class Item>
class Examiner {
 public:
  /// All waiting ends with os::Ended from the moment on in which `over` is true; empty: never.
  Examiner(const EncoderAddress& address, Link link, std::function<bool()> over)
      : link_(std::move(link)),
        runner_(address),
        unit_(*address.unit),
        options_(address.options),
        streams_(address.unit->streams != nullptr && address.unit->streams(address.options)) {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      runner_.attach(*link_.frames, link_.latency);
    } else {
      runner_.attach(*link_.bytes, link_.latency);
    }
    runner_.port().over = std::move(over);
  }

  /// What comes though nothing is asked, in pieces of the time.
  void listen(Observations& seen) {
    if constexpr (!std::is_same_v<Item, CanFrame>) {
      unsigned busy = 0;
      for (unsigned piece = 0; piece < pieces; ++piece) {
        bool heard = false;
        runner_.listen(piece_time, [&](Bytes bytes) {
          heard = true;
          if (seen.unsolicited.size() < most_heard)
            seen.unsolicited.insert(seen.unsolicited.end(), bytes.begin(), bytes.end());
          return true;
        });
        busy += heard ? 1 : 0;
      }
      seen.listened = pieces * piece_time;
      seen.never_silent = busy + 1 >= pieces;
    }
  }

  /// What comes when all was given up: one that answers later than anybody waited for.
  void listen_for_late() { runner_.listen(pieces * piece_time); }

  /// Readings as `read` takes them, and what each of them took on the line.
  void observe(const Command& command, std::size_t count, Time limit, Observations& seen) {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      read(command, count, limit, seen.readings);
    } else if (runner_.character() == Time{}) {
      read(command, count, limit, seen.readings);
    } else {
      ExchangeLog log(unit_, options_, seen);
      const Watch watch(runner_, log, streams_);
      read(command, count, limit, seen.readings, &log);
      // One that sends by a pulse is asked, too.
      if (streams_ && runner_.port().requests == 0) log.conclude_stream();
    }
  }

  /// Up to `count` readings within `limit`; fewer when nobody answers at all. Throws as the port.
  void read(const Command& command, std::size_t count, Time limit, std::vector<Attempted>& into,
            ExchangeLog* log = nullptr) {
    const auto attempt = [&] {
      Attempted one = runner_.once(command);
      if (log != nullptr) log->add_reading(one);
      // A second encoder's reply comes at once behind the first, or into the next request.
      const Time behind = 3 * runner_.character();
      if (one.error == Error::none && behind != Time{} && !streams_) runner_.settle(behind, longest_reply);
      return one;
    };
    runner_.repeat({.count = count, .limit = limit, .patience = never, .least = longest_gap}, attempt, into);
  }

  /// Fields of another command that only reads. Throws as the port.
  void report(const Command& command, Arguments arguments, FieldSink& sink) {
    const Conversation<Item>* conversation = runner_.run(command, arguments);
    if (conversation != nullptr && conversation->error() == Error::none) conversation->report(sink);
  }

  /// Time on the port's clock.
  [[nodiscard]] Time now() { return runner_.port().now(); }

  void conclude(Observations& seen) const {
    seen.line_errors += runner_.port().line_errors;
    seen.late = std::max(seen.late, runner_.late());
    seen.lateness = std::max(seen.lateness, runner_.lateness());
    seen.overfull = runner_.overfull();
    seen.most_behind = runner_.most_behind();
    if constexpr (!std::is_same_v<Item, CanFrame>) {
      seen.echo = runner_.session().echo().mode();
      seen.overfull_example.assign(runner_.overfull_example().begin(), runner_.overfull_example().end());
    }
  }

 private:
  /// Hands what comes to the log, for as long as this lives.
  class Watch {
   public:
    Watch(Runner<Item>& runner, ExchangeLog& log, bool streams) : runner_(runner) {
      runner.on_exchange = [&runner, &log](const LineExchange<Item>& line) {
        Attempted one;
        runner.keep_exchange(one);
        one.began = line.sent_at;
        log.add_exchange(std::move(one));
      };
      if (!streams) return;
      runner.on_event = [&log](const Event<Item>& event) {
        if constexpr (!std::is_same_v<Item, CanFrame>) {
          if (event.kind == Event<Item>::Kind::received) log.add_bytes(event.items, event.at);
        }
      };
    }
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;
    ~Watch() {
      runner_.on_exchange = nullptr;
      runner_.on_event = nullptr;
    }

   private:
    Runner<Item>& runner_;
  };

  static constexpr unsigned pieces = 5;
  static constexpr Time piece_time = std::chrono::milliseconds(20);
  static constexpr std::size_t most_heard = 4096;
  static constexpr Time longest_gap = std::chrono::milliseconds(500);  // of a contact that is loose now and then
  static constexpr Time longest_reply = std::chrono::milliseconds(100);

  Link link_;
  Runner<Item> runner_;
  const Unit& unit_;
  Options options_;
  bool streams_;
};

}  // namespace absenc::client
