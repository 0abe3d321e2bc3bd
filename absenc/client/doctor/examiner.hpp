// SPDX-License-Identifier: Apache-2.0
// Listens to an open link, takes readings over it, and records the observations that doctor judges.
#pragma once

#include <algorithm>
#include <functional>
#include <utility>

#include "absenc/client/doctor/observations.hpp"
#include "absenc/client/port/link.hpp"
#include "absenc/client/port/runner.hpp"

namespace absenc::client {

template <class Item>
class Examiner {
 public:
  /// Takes over an open link. Every wait on the link ends with os::Ended as soon as `over` returns true; an empty
  /// `over` never does.
  Examiner(const EncoderAddress& address, Link link, std::function<bool()> over)
      : link_(std::move(link)),
        runner_(address),
        streams_(address.unit->streams != nullptr && address.unit->streams(address.options)) {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      runner_.attach(*link_.frames, link_.latency);
    } else {
      runner_.attach(*link_.bytes, link_.latency);
    }
    runner_.port().over = std::move(over);
  }

  /// Listens before the first request and records unsolicited bytes. Does nothing on CAN, where other nodes may send.
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

  /// Listens once more, so that replies which are later than every timeout are recorded.
  void listen_for_late() { runner_.listen(pieces * piece_time); }

  /// Takes up to `count` readings within `limit` and adds them to `into`. Ends early if the first ones bring no good
  /// reply. Throws the exceptions of the port.
  void read(const Command& command, std::size_t count, Time limit, std::vector<Attempted>& into) {
    const auto attempt = [&] {
      Attempted one = runner_.once(command);
      // Listens for three characters after a good reply: a second encoder's reply follows at once, or would collide
      // with the next request.
      const Time behind = 3 * runner_.character();
      if (one.error == Error::none && behind != Time{} && !streams_) runner_.settle(behind, longest_reply);
      return one;
    };
    runner_.repeat({.count = count, .limit = limit, .patience = never, .least = longest_gap}, attempt, into);
  }

  /// Runs a command that is no reading of the position, such as a scan, and passes the fields of its reply to `sink` if
  /// the command succeeds. Throws the exceptions of the port.
  void report(const Command& command, Arguments arguments, FieldSink& sink) {
    const Conversation<Item>* conversation = runner_.run(command, arguments);
    if (conversation != nullptr && conversation->error() == Error::none) conversation->report(sink);
  }

  /// Returns the present time of the port's clock.
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
  static constexpr unsigned pieces = 5;
  static constexpr Time piece_time = std::chrono::milliseconds(20);
  static constexpr std::size_t most_heard = 4096;
  // longest time for which a loose contact is assumed to be open
  static constexpr Time longest_gap = std::chrono::milliseconds(500);
  static constexpr Time longest_reply = std::chrono::milliseconds(100);

  Link link_;
  Runner<Item> runner_;
  bool streams_;
};

}  // namespace absenc::client
