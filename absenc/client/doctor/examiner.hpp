// SPDX-License-Identifier: Apache-2.0
// Listens to an open link, takes readings over it, and records the observations that doctor judges.
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "absenc/client/doctor/observations.hpp"
#include "absenc/client/doctor/stream_frames.hpp"
#include "absenc/client/port/link.hpp"
#include "absenc/client/port/runner.hpp"

namespace absenc::client {

template <class Item>
class Examiner {
 public:
  /// Takes over an open link, and uses the callbacks `over` and `exchanged` of `choices`. Every wait on the link ends
  /// with os::Ended as soon as `over` returns true; an empty `over` never does.
  Examiner(const EncoderAddress& address, Link link, const DoctorChoices& choices)
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
    runner_.port().over = choices.over;
    runner_.on_exchange = [this, exchanged = choices.exchanged](const LineExchange<Item>& line) {
      if (exchanged) tell_exchange(line, exchanged);
      if (observer_) observer_(line);
    };
  }

  /// Listens before the first request and records unsolicited bytes. Does nothing on CAN, where other nodes may send.
  void listen(Observations& seen) {
    if constexpr (!std::is_same_v<Item, CanFrame>) {
      unsigned busy = 0;
      std::optional<unsigned> first;
      for (unsigned piece = 0; piece < pieces; ++piece) {
        bool heard = false;
        runner_.listen(piece_time, [&](Bytes bytes) {
          heard = true;
          if (seen.unsolicited.size() < most_heard)
            seen.unsolicited.insert(seen.unsolicited.end(), bytes.begin(), bytes.end());
          return true;
        });
        if (!heard) continue;
        ++busy;
        // A single late reply lies in one period, or in two that follow one another.
        if (piece - first.value_or(piece) >= 2) seen.sends_unasked = true;
        if (!first) first = piece;
      }
      seen.listened = pieces * piece_time;
      seen.never_silent = busy + 1 >= pieces;
    }
  }

  /// Listens once more if the first 100 ms were too short to notice an encoder that sends by itself: if its frames pass
  /// for replies, the slowest of them shows how far apart they are.
  void listen_longer(Observations& seen) {
    if constexpr (!std::is_same_v<Item, CanFrame>) {
      if (seen.sends_unasked || seen.readings.empty() || seen.readings.back().error != Error::none) return;
      Time slowest{};
      for (const Attempted& one : seen.readings) slowest = std::max(slowest, one.answered_after);
      if (slowest <= piece_time) return;
      const Time time = std::min(2 * slowest, longest_silence);
      runner_.listen(time, [&](Bytes bytes) {
        seen.unsolicited.insert(seen.unsolicited.end(), bytes.begin(), bytes.end());
        seen.sends_unasked = true;
        return false;
      });
      seen.listened += time;
    }
  }

  /// Listens once more, for 100 ms, so that a reply later than its timeout is recorded.
  void listen_for_late() { runner_.listen(pieces * piece_time); }

  /// Waits until `at`, a time of the port's clock.
  void wait_until(Time at) {
    if (at > now()) runner_.listen(at - now());
  }

  /// Takes up to `count` readings and adds them to `into`; begins no reading after the time `limit`. Ends early if the
  /// first readings bring no good reply. Throws the exceptions of the port.
  void read(const Command& command, std::size_t count, Time limit, std::vector<Attempted>& into) {
    runner_.repeat(
        series(count, limit), [&] { return attempt_reading(command); }, into);
  }

  /// Takes readings as `read` does and adds them to `seen`. On a line of characters, and on a clocked line whose data
  /// turns, it also adds the failed requests that a reading repeated. On a line of characters it adds evidence of
  /// damaged, missing or doubled frames in a stream, too.
  void observe(const Command& command, std::size_t count, Time limit, Observations& seen) {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      read(command, count, limit, seen.readings);
    } else {
      const std::size_t before = seen.readings.size();
      std::vector<Attempted> requests;  // requests of the present reading that were to be answered
      Options known = options_;         // options of the encoder, with what the last reading showed of it
      StreamBytes stream;
      const Hook hook(*this, [&](const LineExchange<Item>& line) { record_request(line, requests); });
      const auto attempt = [&] {
        requests.clear();
        Attempted one = attempt_reading(command);
        if (one.reading && unit_.learned != nullptr) known = unit_.learned(options_, *one.reading);
        // The failure of the last request is already part of the reading, so it is not stored a second time as a
        // repeated request.
        if (!requests.empty() && requests.back().began == runner_.last().sent_at) requests.pop_back();
        add_failed(requests, known, seen.repeated);
        if (streams_) stream.append(runner_.last());
        return one;
      };
      runner_.repeat(series(count, limit), attempt, seen.readings);
      // Judges a stream only if the host has sent nothing: an encoder that sends a frame for each pulse of the host is
      // polled, and sends no stream.
      if (streams_ && before == 0 && runner_.port().requests == 0) conclude_stream(unit_, options_, stream, seen);
    }
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
  /// Calls a function for each exchange of the runner, as long as this object lives.
  class Hook {
   public:
    Hook(Examiner& examiner, std::function<void(const LineExchange<Item>&)> function) : examiner_(examiner) {
      examiner_.observer_ = std::move(function);
    }
    Hook(const Hook&) = delete;
    Hook& operator=(const Hook&) = delete;
    ~Hook() { examiner_.observer_ = nullptr; }

   private:
    Examiner& examiner_;
  };

  void tell_exchange(const LineExchange<Item>& line,
                     const std::function<void(const DoctorExchange&)>& exchanged) const {
    const capture::ObservedExchange exchange = observed_exchange<Item>(line.request, line.reply(), line.clocks);
    exchanged({.sent = line.sent_at,
               .answered_after = line.answered_after(runner_.character()),
               .request = exchange.request.frame(),
               .reply = exchange.reply.frame()});
  }

  static Series series(std::size_t count, Time limit) {
    return {.count = count, .limit = limit, .patience = never, .least = longest_gap};
  }

  Attempted attempt_reading(const Command& command) {
    Attempted one = runner_.once(command);
    // Listens for three characters after a good reply: a second encoder's reply follows at once, or would collide with
    // the next request.
    const Time behind = 3 * runner_.character();
    if (one.error == Error::none && behind != Time{} && !streams_) runner_.settle(behind, longest_reply);
    return one;
  }

  // Adds the exchange to `requests` if its request was to be answered by the reply that it got. On SPI a reply may
  // answer the request before; on other clocked lines an encoder sends without a request.
  void record_request(const LineExchange<Item>& line, std::vector<Attempted>& requests) const {
    const bool has_characters = unit_.link == LinkKind::half_duplex || unit_.link == LinkKind::full_duplex;
    if (has_characters ? line.answer == Time{} : unit_.link != LinkKind::clocked_bidirectional) return;
    Attempted one;
    runner_.keep_exchange(one);
    if (unit_.is_answered != nullptr && !unit_.is_answered(options_, one.exchange.request.frame())) return;
    one.began = line.sent_at;
    requests.push_back(std::move(one));
  }

  // Moves the requests without a good reply to `failed`; `known`: options of the encoder.
  void add_failed(std::vector<Attempted>& requests, const Options& known, std::vector<Attempted>& failed) const {
    for (Attempted& one : requests) {
      const auto& [request, reply] = one.exchange;
      one.error = one.answered ? unit_.check(known, request.frame(), reply.frame()) : Error::timeout;
      if (one.error != Error::none) failed.push_back(std::move(one));
    }
  }

  static constexpr unsigned pieces = 5;
  static constexpr Time piece_time = std::chrono::milliseconds(20);
  static constexpr Time longest_silence = std::chrono::seconds(1);
  static constexpr std::size_t most_heard = 4096;
  // longest time for which a loose contact is assumed to be open
  static constexpr Time longest_gap = std::chrono::milliseconds(500);
  static constexpr Time longest_reply = std::chrono::milliseconds(100);

  Link link_;
  Runner<Item> runner_;
  const Unit& unit_;
  Options options_;
  bool streams_;
  std::function<void(const LineExchange<Item>&)> observer_{};  // called with each exchange; empty unless a Hook exists
};

}  // namespace absenc::client
