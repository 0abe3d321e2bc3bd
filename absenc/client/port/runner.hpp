// SPDX-License-Identifier: Apache-2.0
// Runs the commands of a unit on a port and keeps each exchange as it was on the line: for readings, doctor, conform
// and identify, which differ in what they look at. Its only clock is that of the port.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "absenc/capture/search/evidence.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/port/watched_port.hpp"
#include "absenc/host/session.hpp"

namespace absenc::client {

/// A command that was run once: how it ended, and its last exchange.
struct Attempted {
  Error error = Error::none;
  std::string detail{};                  // in the words of the unit
  std::string advice{};                  // of the unit; "": none
  Time began{};                          // on the port's clock
  capture::ObservedExchange exchange{};  // the last one, without echo
  std::vector<std::uint8_t> raw{};       // all bytes that came, echo included
  bool heard = false;                    // something came, be it an echo
  bool answered = false;                 // something came that is no echo
  std::uint64_t unanswered = 0;          // requests before the last, behind which nothing came
  std::uint64_t discarded = 0;  // damaged frames of a stream since the one before; `error` may report one of them
  Time answered_after{};        // from the end of the request to the beginning of the reply
  Time limit{};                 // of that: what the protocol and the way allow; 0: none
  Time after{};                 // from the end of the request to the end of the reply
  Time allowed{};               // that the protocol and the characters of the reply take at most
  std::optional<Reading> reading{};
  std::optional<std::int64_t> counter{};  // the first field that counts the replies
  const FieldInfo* counter_field = nullptr;
  bool possible = true;  // false: the unit cannot do it with these options

  /// Whether the reply began after its limit.
  [[nodiscard]] bool is_late() const { return answered && limit > Time{} && answered_after > limit; }
};

/// A request and its reply, without echo. `clocks`: of a clocked link. Of several CAN frames the last one is the reply:
/// what came before it was for others.
template <class Item>
[[nodiscard]] capture::ObservedExchange heard_exchange(std::span<const Item> request, std::span<const Item> reply,
                                                       std::size_t clocks) {
  capture::ObservedExchange exchange;
  if constexpr (std::is_same_v<Item, CanFrame>) {
    if (!request.empty()) exchange.request.can = request.front();
    if (!reply.empty()) exchange.reply.can = reply.back();
  } else {
    exchange.request.bytes.assign(request.begin(), request.end());
    exchange.reply.bytes.assign(reply.begin(), reply.end());
    exchange.reply.bits = std::min(clocks, reply.size() * 8);
  }
  return exchange;
}
template <class Item>
[[nodiscard]] capture::ObservedExchange heard_exchange(const LineExchange<Item>& line) {
  return heard_exchange<Item>(line.request, line.reply(), line.clocks);
}

/// Takes the counter of the replies out of what a command reports.
class CounterSink final : public FieldSink {
 public:
  explicit CounterSink(Attempted& attempt) : attempt_(attempt) {}
  void put(const FieldValue& value) override {
    const bool counts = value.info->role == Role::sequence || value.info->role == Role::life_counter;
    if (!counts || attempt_.counter) return;
    attempt_.counter = value.number;
    attempt_.counter_field = value.info;
  }

 private:
  Attempted& attempt_;
};

/// How long a command is run again and again.
struct Series {
  std::size_t count = 0;
  Time limit = never;                       // of all of them
  Time patience = std::chrono::seconds(2);  // since the last good one
  std::size_t most_silent = 8;              // in vain, until nobody is there,
  Time least{};                             // but no sooner than this
  std::size_t most_bad = 24;                // without a good one
};

template <class Item>
class Runner {
 public:
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;

  /// `attempts`: how often a command that may be repeated is run.
  explicit Runner(const EncoderAddress& address, unsigned attempts = 1)
      : unit_(*address.unit),
        options_(address.options),
        echo_(address.echo),
        storage_(std::make_unique<std::byte[]>(unit_.host_storage)),
        filter_(*this) {
    const bool characters = unit_.link == LinkKind::half_duplex || unit_.link == LinkKind::full_duplex;
    if (characters) character_ = address.line.with_some_rate().character();
    port_.abort = [this] { return session_->abort(); };
    start_again(attempts);
  }
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// The port to use from now on. `latency`: of the way to the line.
  void attach(Port<Item>& port, Time latency = {}) {
    port_.attach(port);
    latency_ = latency;
  }

  // ---- Hooks, of `run` and `once`. They may throw, which ends the conversation.

  std::function<void(std::vector<Item>& request)> edit{};                 // before it is sent
  std::function<void(Step<Item>& step, Time now)> on_step{};              // each that the conversation takes
  std::function<void(const Event<Item>& event)> on_event{};               // each that it is fed, without echo
  std::function<void(const LineExchange<Item>& exchange)> on_exchange{};  // each that is over

  // ---- Commands

  /// What was sent before is forgotten: the reply to it is not waited for, nor kept away.
  void start_again(unsigned attempts = 1) {
    if (session_) {
      echo_ = session_->echo().mode();
      late_before_ += session_->counters().late;
      lateness_ = lateness();
    }
    session_.emplace(unit_, options_, port_, std::span(storage_.get(), unit_.host_storage), echo_, attempts);
    session_->set_filter(&filter_);
  }
  /// From the next command on.
  void set_options(const Options& options) {
    options_ = options;
    session_->set_options(options);
  }

  /// `use(session)` runs one command and returns its conversation.
  template <class Use>
  const Conversation<Item>* converse(const Use& use) {
    if (requests_before_ == port_.requests) port_.last.clear();  // nothing was asked: what came was for that command
    requests_before_ = port_.requests;
    received_before_ = port_.last.received.size();
    unanswered_ = 0;
    port_.return_to(line_settings(unit_, options_).rate);
    const Conversation<Item>* ended = nullptr;
    try {
      ended = use(*session_);
    } catch (...) {
      close_exchange();
      throw;
    }
    close_exchange();
    answered_ = ended != nullptr && ended->error() == Error::none ? port_.last.received.size() : 0;
    return ended;
  }
  /// One command to its end; null when the unit cannot run it. A conversation that streams goes on to its next result.
  const Conversation<Item>* run(const Command& command, Arguments arguments = {}) {
    return converse([&](host::Session<Item>& session) { return session.next(command, arguments); });
  }
  /// The same, as a record.
  Attempted once(const Command& command, Arguments arguments = {}) {
    const std::uint64_t discarded = session_->counters().discarded;
    Attempted one;
    one.began = port_.now();
    const Conversation<Item>* ended = run(command, arguments);
    if (ended == nullptr) {
      one.error = Error::unsupported;
      one.possible = false;
      return one;
    }
    one.error = ended->error();
    one.detail = ended->detail();
    one.advice = ended->advice();
    one.discarded = session_->counters().discarded - discarded;
    if (one.error == Error::none) {
      if (ended->reading() != nullptr) one.reading = *ended->reading();
      CounterSink counter(one);
      ended->report(counter);
    }
    keep_exchange(one);
    if (ended->streams()) keep_frame(one, *ended);
    return one;
  }

  /// `attempt()` returns an Attempted each time. Ends early when there is nobody, or nothing good comes.
  template <class Attempt>
  void repeat(const Series& series, const Attempt& attempt, std::vector<Attempted>& into) {
    const Time begin = port_.now();
    const Time end = series.limit == never ? never : begin + series.limit;
    // On a line that is never silent.
    const Time outer = port_.deadline;
    const Time latest = end == never ? never : begin + 2 * series.limit;
    port_.deadline = std::min(outer, latest);
    struct Restore {
      Time& deadline;
      Time outer;
      ~Restore() { deadline = outer; }
    } const restore{port_.deadline, outer};
    std::size_t good = 0;
    std::size_t heard = 0;
    Time good_at = begin;
    for (std::size_t i = 0; i < series.count; ++i) {
      const Time now = port_.now();
      if (now >= end || now - good_at >= series.patience) return;
      const bool is_nobody = i >= series.most_silent && now - begin >= series.least;
      if (good == 0 && (heard == 0 ? is_nobody : i >= series.most_bad)) return;
      try {
        into.push_back(attempt());
      } catch (const OutOfTime&) {
        if (outer <= latest) throw;
        return;
      }
      heard += into.back().heard ? 1 : 0;
      if (into.back().error != Error::none) continue;
      ++good;
      good_at = port_.now();
    }
  }

  // ---- Without asking

  /// Hears for so long; what comes belongs to the last exchange. `on_items(items)` returns whether to go on.
  template <class OnItems>
  void listen(Time time, const OnItems& on_items) {
    const Step<Item> step{.at = port_.now() + time};
    for (;;) {
      const Event<Item> event = port_.wait(step);
      if (event.kind == Event<Item>::Kind::timer || event.at >= step.at) return;
      if (event.kind == Event<Item>::Kind::received && !on_items(event.items)) return;
    }
  }
  void listen(Time time) {
    listen(time, [](std::span<const Item>) { return true; });
  }
  /// Until nothing has come for `quiet`, and no longer than `longest`. Returns whether anything came.
  bool settle(Time quiet, Time longest) {
    bool heard = false;
    const Time end = port_.now() + longest;
    for (Time now = end - longest; now < end;) {
      const Step<Item> step{.at = now + quiet};
      const Event<Item> event = port_.wait(step);
      if (event.kind == Event<Item>::Kind::timer || event.at >= step.at) break;
      heard = heard || event.kind == Event<Item>::Kind::received;
      now = event.at;
    }
    return heard;
  }

  // ---- What was seen

  /// The last exchange, with what came behind it until now.
  [[nodiscard]] const LineExchange<Item>& last() const { return port_.last; }
  /// How many replies came late: began after their limit, or answered an earlier request than the one behind which they
  /// came.
  [[nodiscard]] std::uint64_t late() const {
    const std::uint64_t seen = late_ + (lateness_of(last()) != Time{} ? 1 : 0);
    return std::max(seen, late_before_ + session_->counters().late);
  }
  /// How long after its request the latest of them came; 0: none did.
  [[nodiscard]] Time lateness() const { return std::max({lateness_, lateness_of(last()), session_->lateness()}); }

  /// How many good replies more came behind, though nobody had asked; not on a CAN bus.
  [[nodiscard]] std::uint64_t overfull() const { return overfull_; }
  /// The most items that came behind one of them.
  [[nodiscard]] std::size_t most_behind() const { return most_behind_; }
  /// All that came in the last such exchange.
  [[nodiscard]] std::span<const Item> overfull_example() const { return overfull_example_; }

  /// What is known of `one` by now, whose exchange was the last.
  void keep_exchange(Attempted& one) const {
    const LineExchange<Item>& line = last();
    const bool asked = requests_before_ != port_.requests;
    const std::size_t before = asked ? 0 : std::min(received_before_, line.received.size());
    const std::span<const Item> received = std::span(line.received).subspan(before);
    const std::span<const Item> reply = asked ? line.reply() : received;
    one.heard = !received.empty();
    one.answered = !reply.empty();
    one.unanswered = unanswered_;
    if (asked) {
      one.answered_after = line.answered_after(character_);
      one.limit = line.answer != Time{} ? line.answer + latency_ : Time{};
      one.after = line.received_at - line.sent_at;
      one.allowed = line.answer + static_cast<std::int64_t>(received.size()) * character_;
    }
    one.exchange = heard_exchange<Item>(asked ? line.request : std::span<const Item>{}, reply, line.clocks);
    if constexpr (!is_can) one.raw.assign(received.begin(), received.end());
  }

  /// The time of a character on the line; 0: it carries none.
  [[nodiscard]] Time character() const { return character_; }
  [[nodiscard]] WatchedPort<Item>& port() { return port_; }
  [[nodiscard]] const WatchedPort<Item>& port() const { return port_; }
  [[nodiscard]] host::Session<Item>& session() { return *session_; }
  [[nodiscard]] const host::Session<Item>& session() const { return *session_; }

 private:
  class Filter final : public host::Filter<Item> {
   public:
    explicit Filter(Runner& runner) : runner_(runner) {}
    void attach(Machine<Item>& inner) override { inner_ = &inner; }
    void feed(const Event<Item>& event) override {
      runner_.keep_echo();
      if (runner_.on_event) runner_.on_event(event);
      inner_->feed(event);
    }
    Step<Item> next(Time now) override {
      using Kind = typename Step<Item>::Kind;
      Step<Item> step = inner_->next(now);
      const bool asks = step.kind == Kind::transfer || step.kind == Kind::pulse;
      if (asks) runner_.begin_exchange();
      if (runner_.on_step) runner_.on_step(step, now);
      if (step.kind == Kind::transfer && runner_.edit) {
        request_.assign(step.out.begin(), step.out.end());
        runner_.edit(request_);
        step.out = request_;
      }
      return step;
    }

   private:
    Runner& runner_;
    Machine<Item>* inner_ = nullptr;
    std::vector<Item> request_;
  };

  // Bytes of a stream may hold several frames, of which each is a result.
  static void keep_frame(Attempted& one, const Conversation<Item>& ended) {
    one.heard = one.answered = one.error != Error::timeout;
    if constexpr (!is_can) {
      const Bytes frame = ended.exchange().received;
      one.raw.assign(frame.begin(), frame.end());
      one.exchange.reply.bytes = one.raw;
    }
  }
  void begin_exchange() {
    const Time lateness = lateness_of(last());
    late_ += lateness != Time{} ? 1 : 0;
    lateness_ = std::max(lateness_, lateness);
    if (requests_before_ != port_.requests && last().reply().empty()) ++unanswered_;
    const std::size_t answered = std::exchange(answered_, 0);
    if (!is_can && answered != 0 && last().received.size() > answered) {
      ++overfull_;
      most_behind_ = std::max(most_behind_, last().received.size() - answered);
      overfull_example_ = last().received;
    }
    close_exchange();
    open_ = true;
    opened_at_ = port_.requests;
  }
  // A hook may have thrown before its request was sent: then the last exchange is the one before.
  void close_exchange() {
    if (std::exchange(open_, false) && opened_at_ != port_.requests && on_exchange) on_exchange(last());
  }
  // With a session anew the last exchange may be of the one before.
  void keep_echo() {
    if constexpr (!is_can) port_.last.echo = std::max(port_.last.echo, session_->echo().echoed());
  }
  // 0: it is not. On a CAN bus others send too.
  [[nodiscard]] Time lateness_of(const LineExchange<Item>& exchange) const {
    if (is_can || exchange.answer == Time{} || exchange.reply().empty()) return {};
    const Time after = exchange.answered_after(character_);
    return after > exchange.answer + latency_ ? after : Time{};
  }

  const Unit& unit_;
  Options options_;
  host::EchoMode echo_;
  Time character_{};  // of the line; 0: it carries no characters
  Time latency_{};
  WatchedPort<Item> port_;
  std::unique_ptr<std::byte[]> storage_;
  Filter filter_;
  std::optional<host::Session<Item>> session_;
  bool open_ = false;                  // the last exchange was not handed to `on_exchange`
  std::uint64_t opened_at_ = 0;        // requests before it
  std::uint64_t requests_before_ = 0;  // the present run
  std::size_t received_before_ = 0;    // that run, behind an older request
  std::uint64_t unanswered_ = 0;       // in this run
  std::uint64_t late_ = 0;             // before the last exchange
  std::uint64_t late_before_ = 0;      // that sessions before this one kept away
  Time lateness_{};
  std::size_t answered_ = 0;  // items when the last exchange ended well
  std::uint64_t overfull_ = 0;
  std::size_t most_behind_ = 0;
  std::vector<Item> overfull_example_;
};

}  // namespace absenc::client
