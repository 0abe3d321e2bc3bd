// SPDX-License-Identifier: Apache-2.0
// Runs commands of a unit on a port and stores the last exchange.
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

/// Result of running a command once, with its last exchange.
struct Attempted {
  Error error = Error::none;
  std::string detail{};                  // the unit's description of the error
  std::string advice{};                  // the unit's advice on the error; "": it has none
  Time began{};                          // time at which the command began, by the port's clock
  capture::ObservedExchange exchange{};  // last request and its reply, without echo
  // bytes received in the last exchange, including the echo; for a stream, the bytes of the frame that gave the result;
  // empty on CAN
  std::vector<std::uint8_t> raw{};
  bool heard = false;            // whether anything was received after the last request; an echo counts, too
  bool answered = false;         // whether something other than an echo was received after the last request
  std::uint64_t unanswered = 0;  // number of requests of this command without reply, except the last request
  // number of damaged frames that this command discarded
  std::uint64_t discarded = 0;
  Time answered_after{};  // time from the end of the request to the beginning of the reply; 0 without a reply
  // greatest time to the beginning of the reply (`answered_after`) that protocol and connection allow; 0: no limit
  Time limit{};
  Time latency{};    // delay that the connection may have added to `answered_after`; it is a part of `limit`, too
  Time sent_late{};  // the request may have ended earlier by up to this time, and `answered_after` be longer by it
  Time after{};      // time from the end of the request to the end of the reply; meaningless without a reply
  // greatest time to the end of the reply (`after`) that the protocol allows for a reply of this length
  Time allowed{};
  std::optional<Reading> reading{};
  // value of the first field of the reply that counts replies; nothing: no field does, or no reply came
  std::optional<std::int64_t> counter{};
  const FieldInfo* counter_field = nullptr;
  // whether a request before was not answered, so that the reply may be a late one to that request
  bool in_doubt = false;
  bool possible = true;  // whether the unit has a command that can be run with the options of the encoder

  /// Returns whether there is a reply with a time limit and it began after that limit.
  [[nodiscard]] bool is_late() const { return answered && limit > Time{} && answered_after > limit; }
};

/// Returns request and reply as an exchange; of several received CAN frames, the last one is the reply.
template <class Item>
[[nodiscard]] capture::ObservedExchange observed_exchange(std::span<const Item> request, std::span<const Item> reply,
                                                          std::size_t clocks) {
  capture::ObservedExchange exchange;
  if constexpr (std::is_same_v<Item, CanFrame>) {
    if (!request.empty()) exchange.request.can = request.front();
    if (!reply.empty()) exchange.reply.can = reply.back();
  } else {
    exchange.request.bytes.assign(request.begin(), request.end());
    exchange.request.bits = clocks != 0 ? request.size() * 8 : 0;
    exchange.reply.bytes.assign(reply.begin(), reply.end());
    exchange.reply.bits = std::min(clocks, reply.size() * 8);
  }
  return exchange;
}
template <class Item>
[[nodiscard]] capture::ObservedExchange observed_exchange(const LineExchange<Item>& line) {
  return observed_exchange<Item>(line.request, line.reply(), line.clocks);
}

/// Stores the value of the first field that counts replies among the fields of a reply.
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

/// Limits of a series of runs of the same command.
struct Series {
  std::size_t count = 0;
  Time limit = never;                       // time after which no further run begins
  Time patience = std::chrono::seconds(2);  // longest time without a good reply; then the series ends
  // number of runs without any received byte or frame after which the series ends
  std::size_t most_silent = 8;
  Time least{};               // the series does not end because of `most_silent` before this time
  std::size_t most_bad = 24;  // number of runs without a good reply after which the series ends
};

template <class Item>
class Runner {
 public:
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;

  /// Takes the address of the encoder, and how often at most a command that may be repeated is tried.
  explicit Runner(const EncoderAddress& address, unsigned attempts = 1)
      : unit_(*address.unit),
        options_(address.options),
        echo_(address.echo),
        storage_(std::make_unique<std::byte[]>(unit_.host_storage)),
        filter_(*this) {
    const bool characters = unit_.link == LinkKind::half_duplex || unit_.link == LinkKind::full_duplex;
    if (characters) character_ = address.line.with_some_rate().byte_time();
    port_.abort = [this] { return session_->abort(); };
    start_again(attempts);
  }
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// Uses `port` from now on. `latency` is the delay that the connection from the port to the line adds to a reply.
  void attach(Port<Item>& port, Time latency = {}) {
    port_.attach(port);
    latency_ = latency;
  }

  // ---- Hooks; empty: not called

  std::function<void(std::vector<Item>& request)> edit{};  // hook that changes each request before it is sent
  // hook that sees, and may change, each step of the conversation
  std::function<void(Step<Item>& step, Time now)> on_step{};
  // hook that sees each event of the conversation, without echo
  std::function<void(const Event<Item>& event)> on_event{};
  // hook that sees each exchange when it has ended
  std::function<void(const LineExchange<Item>& exchange)> on_exchange{};

  // ---- Commands

  /// Starts a session that does not wait for replies to earlier requests.
  void start_again(unsigned attempts = 1) {
    if (session_) {
      echo_ = session_->echo().mode();
      late_before_ += session_->counters().late;
      lateness_ = lateness();
    }
    session_.emplace(unit_, options_, port_, std::span(storage_.get(), unit_.host_storage), echo_, attempts);
    session_->set_filter(&filter_);
  }
  /// Sets the options of the encoder, which apply from the next command on.
  void set_options(const Options& options) {
    options_ = options;
    session_->set_options(options);
  }

  /// Calls `use` with the session to start a command, and returns the conversation of the command; null if the unit
  /// cannot run the command.
  template <class Use>
  const Conversation<Item>* converse(const Use& use) {
    // Clears the stored exchange if the previous command sent no request, because it then belongs to an earlier
    // command.
    if (requests_before_ == port_.requests) port_.last.clear();
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
  /// Runs a command and returns its conversation; null if the unit cannot run the command.
  const Conversation<Item>* run(const Command& command, Arguments arguments = {}) {
    return converse([&](host::Session<Item>& session) { return session.next(command, arguments); });
  }
  /// Runs one command to its end and returns its result, with the last exchange.
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

  template <class Attempt>
  void repeat(const Series& series, const Attempt& attempt, std::vector<Attempted>& into) {
    const Time begin = port_.now();
    const Time end = series.limit == never ? never : begin + series.limit;
    // Each attempt to run the command has a time limit of its own: on a line that is never silent the attempt might not
    // end.
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

  // ---- Listening without a request

  /// Listens for `time` and passes received bytes or frames to `on_items`; ends early if `on_items` returns false.
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
  /// Waits until the line has been silent for `quiet`, but not much longer than `longest`. Returns whether anything was
  /// received.
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

  // ---- Observations of the line

  /// Returns the last request with everything that was received since then.
  [[nodiscard]] const LineExchange<Item>& last() const { return port_.last; }
  [[nodiscard]] std::uint64_t late() const {
    const std::uint64_t seen = late_ + (lateness_of(last()) != Time{} ? 1 : 0);
    return std::max(seen, late_before_ + session_->counters().late);
  }
  /// Returns the longest time between a request and its late reply; 0 if no reply was late.
  [[nodiscard]] Time lateness() const { return std::max({lateness_, lateness_of(last()), session_->lateness()}); }

  /// Returns how many good replies were followed by further bytes before the next request.
  [[nodiscard]] std::uint64_t overfull() const { return overfull_; }
  /// Returns the greatest number of further bytes or frames that followed a good reply.
  [[nodiscard]] std::size_t most_behind() const { return most_behind_; }
  /// Returns all received bytes or frames of the last exchange in which further ones followed the good reply.
  [[nodiscard]] std::span<const Item> overfull_example() const { return overfull_example_; }

  /// Copies the last exchange into `one`, the result of the last command.
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
      one.latency = latency_;
      one.sent_late = line.sent_late;
      one.after = line.received_at - line.sent_at;
      one.allowed = line.answer + static_cast<std::int64_t>(received.size()) * character_;
    }
    one.exchange = observed_exchange<Item>(asked ? line.request : std::span<const Item>{}, reply, line.clocks);
    if constexpr (!is_can) one.raw.assign(received.begin(), received.end());
  }

  /// Returns the duration of a byte on the line; 0 if the line carries no characters.
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

  // Stores the frame that gave the result: the received bytes of a stream may hold several frames, each with a result
  // of its own.
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
  // Passes the last exchange to `on_exchange`, unless no request followed `begin_exchange`: then it was passed before.
  void close_exchange() {
    if (std::exchange(open_, false) && opened_at_ != port_.requests && on_exchange) on_exchange(last());
  }
  // Stores the length of the echo in the last exchange. A new session does not know the echo of a request before it, so
  // the greater of the known lengths is stored.
  void keep_echo() {
    if constexpr (!is_can) port_.last.echo = std::max(port_.last.echo, session_->echo().echoed());
  }
  // Returns how late the reply was; 0 if it was not late, and on CAN, where it may be from another node.
  [[nodiscard]] Time lateness_of(const LineExchange<Item>& exchange) const {
    if (is_can || exchange.answer == Time{} || exchange.reply().empty()) return {};
    const Time after = exchange.answered_after(character_);
    return after > exchange.answer + latency_ ? after : Time{};
  }

  const Unit& unit_;
  Options options_;
  host::EchoMode echo_;
  Time character_{};  // duration of a byte; 0 if the line carries no characters
  Time latency_{};
  WatchedPort<Item> port_;
  std::unique_ptr<std::byte[]> storage_;
  Filter filter_;
  std::optional<host::Session<Item>> session_;
  bool open_ = false;                  // whether the last exchange has not been passed to `on_exchange` yet
  std::uint64_t opened_at_ = 0;        // number of requests that were sent before the last exchange began
  std::uint64_t requests_before_ = 0;  // number of requests that were sent before the present command
  // number of bytes or frames that were received before the present command began; they belong to an older request
  std::size_t received_before_ = 0;
  std::uint64_t unanswered_ = 0;  // number of requests without reply in the present command
  // number of late replies so far; a late reply in the last exchange is not counted yet
  std::uint64_t late_ = 0;
  std::uint64_t late_before_ = 0;  // number of late replies that earlier sessions discarded
  Time lateness_{};
  // number of received bytes or frames at the end of the last command, if it ended without an error; else 0
  std::size_t answered_ = 0;
  std::uint64_t overfull_ = 0;
  std::size_t most_behind_ = 0;
  std::vector<Item> overfull_example_;
};

}  // namespace absenc::client
