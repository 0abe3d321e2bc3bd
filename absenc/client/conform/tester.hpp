// SPDX-License-Identifier: Apache-2.0
// Tests clauses of a protocol's document, and gives ChangeTester access to the line.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "absenc/client/conform/changes.hpp"
#include "absenc/client/conform/evidence.hpp"
#include "absenc/client/conform/readings.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/port/runner.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

template <class Item>
class Tester {
 public:
  Tester(const EncoderAddress& address, Port<Item>& port, Time latency, const ConformChoices& choices)
      : unit_(*address.unit),
        options_(address.options),
        latency_(latency),
        rate_(address.line.with_some_rate().rate),
        listening_(least_listening + reply_characters * address.line.with_some_rate().character()),
        runner_(address),
        read_(*find_command(unit_, Verb::read)),
        count_(std::max<std::size_t>(1, choices.readings)) {
    runner_.attach(port, latency);
    // Throws os::Interrupted only once, so that changed values can still be restored afterwards.
    runner_.port().over = [this, over = choices.over] {
      if (!over || ended_ || !over()) return false;
      ended_ = true;
      throw os::Interrupted{};
    };
  }
  Tester(const Tester&) = delete;
  Tester& operator=(const Tester&) = delete;

  /// Takes the readings that the tests judge; must be called before the tests.
  void read() { readings_ = read_all(options_); }

  /// Returns whether ConformChoices::over ended the test.
  [[nodiscard]] bool ended() const { return ended_; }

  /// Returns access to the line for tests that change the encoder.
  [[nodiscard]] ChangesLine line() {
    return {.run = [this](const Command& command, Arguments arguments) { return run(command, arguments, 3); },
            .send = [this](const std::vector<std::uint8_t>& request) { return send(request); },
            .count_unsolicited = [this](Time time) { return count_unsolicited(time); },
            .wait_for = [this](Time time) { runner_.listen(time); },
            .note_setting = [this](const Command& setter,
                                   std::int64_t value) { options_ = options_behind(unit_, options_, setter, value); },
            .options = [this]() -> const Options& { return options_; }};
  }

  void test(const Clause& clause, ClauseResult& result) {
    switch (clause.demand) {
      case Demand::answered:
        return judge_answered(readings_, result);
      case Demand::streamed:
        return judge_streamed(readings_, result);
      case Demand::in_time:
        return judge_time(unit_, options_, readings_, result);
      case Demand::whole:
        return test_frames(clause, any_of(Error::wrong_length, Error::truncated), result);
      case Demand::checked:
        return test_frames(clause, any_of(Error::bad_checksum), result);
      case Demand::as_drawn:
        return test_frames(clause, clause.errors != 0 ? clause.errors : form_errors, result);
      case Demand::does:
        return test_command(clause, result);
      case Demand::foreign_silent:
        return test_foreign(result);
      case Demand::reacts:
        return test_reaction(clause, result);
      default:
        return;
    }
  }

 private:
  // Thrown instead of sending a further request after an edited one: a host would repeat the request, and judge the
  // second reply.
  struct NextRequest {};

  // The test listens for a reply for 20 ms plus the duration of 16 characters.
  static constexpr Time least_listening = std::chrono::milliseconds(20);
  static constexpr int reply_characters = 16;
  // After a request that the encoder must answer, the test listens this long for a late reply, so that it does not take
  // that reply for the one to its next request.
  static constexpr Time late_listening = std::chrono::milliseconds(500);
  static constexpr unsigned most_late_listenings = 8;  // bounds the time that a silent encoder costs
  static constexpr unsigned times = 3;  // number of times that each test sends its command or request to the encoder
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;

  // ---- Access to the line

  CommandResult run(const Command& command, Arguments arguments, unsigned attempts) {
    runner_.set_options(options_);
    runner_.start_again(attempts);
    const std::uint64_t before = runner_.port().requests;
    const Conversation<Item>* ended = runner_.run(command, arguments);
    if (runner_.port().take_aborted()) throw os::Interrupted{};
    if (ended == nullptr) throw UsageError(fmt::format("{} cannot run {} with these options", unit_.id, command.name));
    CommandResult ran{.error = ended->error(),
                      .detail = std::string(ended->detail()),
                      .requests = runner_.port().requests - before,
                      .heard = !runner_.last().reply().empty()};
    if (ran.error != Error::none) return ran;
    if (const Reading* reading = ended->reading()) ran.reading = *reading;
    CommandSink told(ran);
    ended->report(told);
    ran.answer = std::move(told.sink.answer);
    return ran;
  }
  struct CommandSink final : FieldSink {
    explicit CommandSink(CommandResult& into) : ran(into) {}
    void put(const FieldValue& field) override {
      if (field.info->role == Role::data) ran.data.assign(field.bytes.begin(), field.bytes.end());
      if (field.info->role == Role::value) ran.value = field.number;
      sink.put(field);
    }
    CommandResult& ran;
    AnswerSink sink;
  };

  Attempted once(const Options& options, std::optional<Time> listen_for = {}) {
    runner_.set_options(options);
    if (!is_streamed(options)) runner_.start_again();
    Attempted one = read_once();
    if (!one.possible || one.error == Error::invalid_argument) {
      throw UsageError(fmt::format("{} cannot be read with these options{}{}", unit_.id, one.detail.empty() ? "" : ": ",
                                   one.detail));
    }
    if (one.error == Error::none || !is_polled() || is_streamed(options)) return one;
    // A reading without any reply is a timeout, whatever error the host reports.
    if (!one.answered) one.error = Error::timeout;
    runner_.listen(listen_for.value_or(listening_));
    runner_.keep_exchange(one);
    return one;
  }
  // Reads the encoder by requests that it must answer, and waits for late replies.
  Attempted once_answered(const Options& options) {
    Attempted one = once(options);
    if (one.error == Error::none || !is_polled() || is_streamed(options)) return one;
    Time listen_for = 2 * lateness_;
    if (!one.answered && late_listenings_ < most_late_listenings) {
      ++late_listenings_;
      listen_for = std::max(listen_for, late_listening);
    }
    if (!one.answered && listen_for > listening_) {
      runner_.listen(listen_for - listening_);
      runner_.keep_exchange(one);
    }
    if (one.is_late()) lateness_ = std::max(lateness_, one.answered_after);
    return one;
  }
  // Runs a reading once. NextRequest ends the reading after its first exchange.
  Attempted read_once() {
    try {
      return runner_.once(read_);
    } catch (const NextRequest&) {
      Attempted first;
      runner_.keep_exchange(first);
      first.error = first.answered ? error_of(first.exchange.request, first) : Error::timeout;
      return first;
    }
  }
  [[nodiscard]] Readings read_all(const Options& options) {
    Readings readings;
    bool is_outstanding = false;  // whether the late reply to an earlier request may still come
    const auto attempt = [&] {
      const std::uint64_t before = runner_.port().requests;
      Attempted one = once_answered(options);
      const std::uint64_t requests = runner_.port().requests - before;
      one.in_doubt = is_polled() && (is_outstanding || one.unanswered != 0);
      is_outstanding = one.in_doubt || (requests != 0 && !was_answered(one));
      const std::uint64_t unanswered = std::min(requests, one.unanswered + (was_answered(one) ? 0 : 1));
      readings.requests += requests;
      // If the last reply was late, the replies to the requests before it are assumed to be late, not missing.
      readings.answered += was_answered(one) && one.is_late() ? requests : requests - unanswered;
      readings.good += one.error == Error::none ? std::max<std::uint64_t>(requests, 1) : 0;
      if (was_answered(one) && one.is_late()) readings.late += requests;
      if (one.in_doubt && was_answered(one) && !one.is_late()) {
        ++readings.in_doubt;
        readings.good_in_doubt += one.error == Error::none ? std::max<std::uint64_t>(requests, 1) : 0;
      }
      readings.discarded += one.discarded;
      return one;
    };
    runner_.repeat({.count = count_}, attempt, readings.all);
    return readings;
  }
  [[nodiscard]] bool is_streamed(const Options& options) const {
    return unit_.streams != nullptr && unit_.streams(options);
  }
  // On SPI and clocked links the host clocks the bits, so no reply can be late.
  [[nodiscard]] bool is_polled() const { return !host_clocks(unit_.link); }
  // Returns whether the encoder can be read; if it cannot, a missing reply proves nothing.
  [[nodiscard]] bool answers() {
    for (unsigned i = 0; i < times; ++i) {
      if (once_answered(options_).error == Error::none) return true;
    }
    return false;
  }

  /// Sends an edited request instead of the first request of a reading, and no further request.
  std::optional<Attempted> send_instead(const std::function<void(std::vector<Item>&)>& edit, std::uint32_t permille = 0,
                                        std::optional<Time> listen_for = {}) {
    const std::uint64_t before = runner_.port().requests;
    bool edited = false;
    runner_.edit = [&](std::vector<Item>& request) {
      if (std::exchange(edited, true)) throw NextRequest{};
      edit(request);
      if (permille != 0) set_rate(rate_ / 1000 * permille);
    };
    runner_.on_event = [&](const Event<Item>& event) {
      if (permille != 0 && event.kind == Event<Item>::Kind::sent) set_rate(rate_);
    };
    struct Restore {
      Runner<Item>& runner;
      ~Restore() {
        runner.edit = {};
        runner.on_event = {};
      }
    } const restore{runner_};
    Attempted one = once(options_, listen_for);
    if (runner_.port().requests == before) return std::nullopt;
    return one;
  }
  void set_rate(std::uint32_t rate) { runner_.port().begin({.kind = Step<Item>::Kind::configure, .rate = rate}); }
  /// Sends a request, given as bytes or, for a CAN bus, as text, and returns the exchange.
  SingleExchange send(const std::vector<std::uint8_t>& request) {
    SingleExchange sent;
    const auto attempted = send_instead([&](std::vector<Item>& edited) { edited = items_of(request); }, 0,
                                        2 * unit_.timing.turnaround + latency_);
    if (attempted) sent = {.request = attempted->exchange.request, .reply = attempted->exchange.reply};
    return sent;
  }
  [[nodiscard]] std::vector<Item> items_of(const std::vector<std::uint8_t>& request) const {
    if constexpr (is_can) {
      const std::string text(request.begin(), request.end());
      return {*parse_wire_text(unit_.link, "a request", text).can};
    } else {
      return request;
    }
  }
  /// Listens for `time` and counts the good CAN frames that have the identifier of a reply to a reading; returns 0 if
  /// the link is not CAN.
  UnsolicitedFrames count_unsolicited(Time time) {
    UnsolicitedFrames heard;
    const Attempted* const good = readings_.first_good();
    if constexpr (is_can) {
      if (good == nullptr || !good->exchange.reply.can) return heard;
      runner_.listen(time, [&](std::span<const CanFrame> frames) {
        for (const CanFrame& frame : frames) {
          if (frame.id != good->exchange.reply.can->id) continue;
          if (unit_.check(options_, {}, {.can = &frame}) != Error::none) continue;
          heard.last = runner_.last().received_at;
          if (heard.frames++ == 0) heard.first = heard.last;
        }
        return true;
      });
    }
    return heard;
  }

  // ---- Readings

  void test_frames(const Clause& clause, Errors errors, ClauseResult& result) {
    if (clause.option.empty()) return judge_frames(unit_, options_, readings_, errors, result);
    Options options = options_;
    for (std::size_t i = 0; i < unit_.options.size(); ++i) {
      if (unit_.options[i].name == clause.option) options.values[i] = clause.value;
    }
    judge_frames(unit_, options, read_all(options), errors, result);
  }

  void test_command(const Clause& clause, ClauseResult& result) {
    const Command& command = *find_command(unit_, clause.command);
    const std::vector<std::int64_t> arguments = complete_arguments(command, {});
    std::uint64_t requests = 0;
    for (unsigned i = 0; i < times; ++i) {
      const CommandResult ran = run(command, arguments, 1);
      requests += ran.requests;
      if (ran.error == Error::none) continue;
      const std::string_view name = error_texts[static_cast<std::size_t>(ran.error)].name;
      result.evidence = fmt::format("{}: {} {}", command.name, name, ran.detail);
      const bool has_none = ran.error == Error::unsupported || ran.error == Error::invalid_argument;
      if (i != 0 || !has_none) conclude(result, false, result.evidence);
      return;
    }
    result.evidence = "with these options nothing is asked";
    if (requests != 0) conclude(result, true, fmt::format("{} of {} times, {} requests", times, times, requests));
  }

  // ---- Requests that no host sends

  // Sends requests to several addresses other than the encoder's: at a single address another device on the line may
  // reply.
  void test_foreign(ClauseResult& result) {
    constexpr std::size_t most_addresses = 8;
    const auto role = std::find_if(unit_.options.begin(), unit_.options.end(),
                                   [](const Option& one) { return one.role == Role::encoder; });
    if (role == unit_.options.end()) return;
    const auto index = static_cast<std::size_t>(role - unit_.options.begin());
    const std::int64_t own = options_.values[index];
    std::vector<std::int64_t> addresses;
    for (std::int64_t value = role->maximum; value >= role->minimum && addresses.size() < most_addresses;
         value -= role->step) {
      if (value != own && is_address(index, value)) addresses.push_back(value);
    }
    result.evidence = "the encoder does not answer";
    if (!answers()) return;
    std::string seen;
    std::size_t alike = 0;
    for (const std::int64_t address : addresses) {
      Options other = options_;
      other.values[index] = address;
      const std::uint64_t before = runner_.port().requests;
      const Attempted one = once(other);
      result.evidence = "with these options nothing is asked";
      if (runner_.port().requests == before) return;
      seen = fmt::format("address {}: {}", address,
                         exchange_text(unit_.link, one.exchange.request.frame(), one.exchange.reply.frame()));
      if (is_silent(one)) {
        result.evidence = seen + ", but the encoder does not answer its own address any more";
        if (answers()) conclude(result, true, seen + ", and to its own address a good reply");
        return;
      }
      const bool of_own = error_of(own_request(), one) == Error::none;
      if (one.error != Error::none && of_own) return conclude(result, false, seen + ", which is the reply of this one");
      const CommandResult here = run(read_, {}, times);
      const bool same = one.reading && here.reading && is_near(*here.reading, one.reading->singleturn);
      alike += one.error != Error::none || same ? 1 : 0;
    }
    result.evidence =
        fmt::format("{} other addresses were asked, and all are answered; the last: {}", addresses.size(), seen);
    if (!addresses.empty() && alike == addresses.size()) conclude(result, false, result.evidence);
  }
  [[nodiscard]] bool is_address(std::size_t index, std::int64_t value) const {
    Options other = options_;
    other.values[index] = value;
    std::vector<std::uint8_t> request(longest_request);
    const auto size = unit_.encode(other, read_, {}, request);
    if (!size || *size == 0) return false;
    if constexpr (is_can) return true;
    const Frame frame{.bytes = Bytes(request).first(*size)};
    return unit_.check(options_, frame, {}) == Error::none &&
           encoder_of(unit_, options_, frame).value_or(value) == value;
  }
  // Returns whether the encoder did not reply. On CAN, other frames are ignored, because a node may send them at any
  // time.
  [[nodiscard]] static bool is_silent(const Attempted& one) {
    if constexpr (is_can) return one.error == Error::timeout;
    return !one.answered;
  }
  [[nodiscard]] capture::ObservedFrame own_request() const {
    const Attempted* const good = readings_.first_good();
    return good != nullptr ? good->exchange.request : capture::ObservedFrame{};
  }
  [[nodiscard]] Error error_of(const capture::ObservedFrame& request, const Attempted& one) const {
    return unit_.check(options_, request.frame(), one.exchange.reply.frame());
  }

  enum class Compliance : std::uint8_t { as_demanded, contrary, unclear };

  void test_reaction(const Clause& clause, ClauseResult& result) {
    const bool slow = clause.ask.permille != 0;
    result.evidence = "the encoder does not answer";
    if (!answers()) return;
    unsigned as_demanded = 0;
    std::string last;
    for (unsigned i = 0; i < times; ++i) {
      std::optional<Attempted> one;
      try {
        one = ask(clause.ask);
      } catch (const os::Failure& failure) {
        if (failure.kind() != os::Failure::Kind::unsupported && failure.kind() != os::Failure::Kind::bad_rate) throw;
        result.evidence = failure.what();
        return;
      }
      result.evidence = "with these options nothing is asked";
      if (!one) return;
      last = exchange_text(unit_.link, one->exchange.request.frame(), one->exchange.reply.frame());
      const Compliance seen = reaction_of(clause, *one);
      // A reply may be missed because the port returns to its usual rate too late to receive it.
      const bool missed = slow && (is_silent(*one) || seen == Compliance::unclear);
      result.evidence = last + ": a port that changes its rate may be too late to hear the reply";
      if (missed) return;
      if (seen == Compliance::contrary) return conclude(result, false, std::move(last));
      as_demanded += seen == Compliance::as_demanded ? 1 : 0;
      result.evidence = last + ", but the encoder does not answer any more";
      if (!answers()) return;
    }
    conclude(result, as_demanded != 0, fmt::format("{} of {} times; {}", as_demanded, times, last));
  }
  std::optional<Attempted> ask(const Ask& ask) {
    const std::vector<std::uint8_t> bytes = request_of_ask(unit_, options_, ask);
    return send_instead([&](std::vector<Item>& request) { request = items_of(bytes); }, ask.permille);
  }
  [[nodiscard]] Compliance reaction_of(const Clause& clause, const Attempted& one) const {
    if (is_silent(one)) {
      const bool silent = clause.reaction == Reaction::silent || clause.reaction == Reaction::refusal_or_silent;
      return silent ? Compliance::as_demanded : Compliance::contrary;
    }
    if (clause.reaction == Reaction::silent) return Compliance::contrary;
    const Error error = reply_error(unit_, options_, clause.as, one.exchange);
    const Error wanted = clause.reaction == Reaction::reply ? Error::none : Error::request_rejected;
    if (error == wanted) return Compliance::as_demanded;
    return error == Error::bad_checksum || error == Error::wrong_length ? Compliance::unclear : Compliance::contrary;
  }

  const Unit& unit_;
  Options options_;
  Time latency_;
  std::uint32_t rate_;
  Time listening_;
  Runner<Item> runner_;
  const Command& read_;
  std::size_t count_;
  Time lateness_{};               // longest time to a late reply so far; 0: no reply was late
  unsigned late_listenings_ = 0;  // number of waits for a late reply so far
  bool ended_ = false;            // whether ConformChoices::over ended the test
  Readings readings_{};
};

}  // namespace absenc::client
