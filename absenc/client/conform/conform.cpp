// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/conform_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "absenc/client/conform/changes.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/way/runner.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

namespace {

constexpr Time listening = std::chrono::milliseconds(20);  // for what comes though nobody waits for it any more
constexpr std::size_t longest_request = 64;

bool breaks(Demand demand, Error error) {
  switch (demand) {
    case Demand::whole:
      return error == Error::wrong_length || error == Error::truncated;
    case Demand::checked:
      return error == Error::bad_checksum;
    case Demand::as_drawn:
      return error == Error::bad_framing || error == Error::unexpected_reply || error == Error::out_of_range ||
             error == Error::cross_check_failed || error == Error::line_stuck;
    default:
      return false;
  }
}

template <class Item>
class Tester {
 public:
  Tester(const EncoderAddress& address, Port<Item>& port, Time latency, const ConformChoices& choices)
      : unit_(*address.unit),
        options_(address.options),
        latency_(latency),
        runner_(address),
        read_(*find_command(unit_, Verb::read)),
        count_(std::max<std::size_t>(1, choices.readings)) {
    runner_.attach(port, latency);
    // Once, so that what was changed can still be put back.
    runner_.port().over = [this, over = choices.over] {
      if (!over || ended_ || !over()) return false;
      ended_ = true;
      throw os::Interrupted{};
    };
  }

  void read() { exchanges_ = read_all(options_); }

  [[nodiscard]] bool ended() const { return ended_; }

  [[nodiscard]] ChangesLine line() {
    return {.run = [this](const Command& command, Arguments arguments) { return run(command, arguments); },
            .rest = [this](Time time) { runner_.listen(time); },
            .follow = [this](const Command& setter,
                             std::int64_t value) { options_ = options_behind(unit_, options_, setter, value); }};
  }

  void test(const Clause& clause, ClauseResult& result) {
    switch (clause.demand) {
      case Demand::answered:
        return test_answered(result);
      case Demand::in_time:
        return test_time(result);
      case Demand::whole:
      case Demand::checked:
      case Demand::as_drawn:
        return test_frames(clause, result);
      case Demand::foreign_silent:
        return test_foreign(result);
      case Demand::damaged_silent:
      case Demand::unknown_silent:
      case Demand::unknown_reported:
        return test_request(clause, result);
      case Demand::restarts:
        return test_restart(clause, result);
      default:
        return;
    }
  }

 private:
  // A conversation that changes the encoder for its own use leaves it as it was when somebody asks to end.
  Ran run(const Command& command, Arguments arguments) {
    constexpr unsigned attempts = 3;
    runner_.set_options(options_);
    runner_.start_again(attempts);
    const Conversation<Item>* ended = runner_.run(command, arguments);
    if (runner_.port().take_aborted()) throw os::Interrupted{};
    if (ended == nullptr) throw UsageError(fmt::format("{} cannot run {} with these options", unit_.id, command.name));
    Ran ran{.error = ended->error(), .detail = std::string(ended->detail())};
    if (ran.error != Error::none) return ran;
    if (const Reading* reading = ended->reading()) ran.reading = *reading;
    Told told(ran);
    ended->report(told);
    ran.answer = std::move(told.sink.answer);
    return ran;
  }
  struct Told final : FieldSink {
    explicit Told(Ran& into) : ran(into) {}
    void put(const FieldValue& field) override {
      if (field.info->role == Role::data) ran.data.assign(field.bytes.begin(), field.bytes.end());
      if (field.info->role == Role::value && ran.data.empty()) ran.data = {static_cast<std::uint8_t>(field.number)};
      sink.put(field);
    }
    Ran& ran;
    AnswerSink sink;
  };

  // What one request owes is nothing to the next. What comes when the host has asked again is late, not missing.
  Attempted once(const Options& options) {
    runner_.set_options(options);
    if (!is_streamed(options)) runner_.start_again();
    Attempted one = runner_.once(read_);
    if (!one.possible) {
      throw UsageError(fmt::format("{} cannot be read with these options", unit_.id));
    }
    if (one.error == Error::none || !is_asked() || is_streamed(options)) return one;
    // What a host makes of silence is no matter of what came.
    if (!one.answered) one.error = Error::timeout;
    runner_.listen(listening);
    runner_.keep_exchange(one);
    return one;
  }
  [[nodiscard]] std::vector<Attempted> read_all(const Options& options) {
    std::vector<Attempted> exchanges;
    runner_.repeat(
        {.count = count_}, [&] { return once(options); }, exchanges);
    return exchanges;
  }
  [[nodiscard]] static bool came(const Attempted& one) {
    return one.answered && (one.unanswered == 0 || one.is_late()) && one.error != Error::line_stuck;
  }
  [[nodiscard]] bool is_streamed(const Options& options) const {
    return unit_.streams != nullptr && unit_.streams(options);
  }
  // Else the host is the clock.
  [[nodiscard]] bool is_asked() const { return unit_.link != LinkKind::clocked && unit_.link != LinkKind::spi; }

  void test_answered(ClauseResult& result) const {
    const auto answered = std::count_if(exchanges_.begin(), exchanges_.end(), came);
    conclude(result, answered == std::ssize(exchanges_), fmt::format("{} of {} answered", answered, exchanges_.size()));
  }

  void test_time(ClauseResult& result) const {
    const Attempted* worst = nullptr;
    for (const Attempted& one : exchanges_) {
      if (!came(one) || one.limit == Time{}) continue;
      if (worst == nullptr || one.answered_after > worst->answered_after) worst = &one;
    }
    if (worst == nullptr) return;
    const auto us = [](Time time) { return std::chrono::duration<double, std::micro>(time).count(); };
    std::string seen =
        fmt::format("at most {:.1f} us, of {:.1f} us that a host waits", us(worst->answered_after), us(worst->limit));
    if (latency_ > Time{}) seen += fmt::format("; this port tells it to within {:.1f} us", us(latency_));
    conclude(result, worst->answered_after <= worst->limit, std::move(seen));
  }

  [[nodiscard]] std::vector<Attempted> read_with(std::string_view option, std::int64_t value) {
    Options other = options_;
    for (std::size_t i = 0; i < unit_.options.size(); ++i) {
      if (unit_.options[i].name == option) other.values[i] = value;
    }
    return read_all(other);
  }

  void test_frames(const Clause& clause, ClauseResult& result) {
    const std::vector<Attempted> exchanges =
        clause.option.empty() ? exchanges_ : read_with(clause.option, clause.value);
    std::size_t replies = 0;
    std::size_t bad = 0;
    std::uint64_t discarded = 0;
    std::string first;
    for (const Attempted& one : exchanges) {
      replies += came(one) ? 1 : 0;
      discarded += one.discarded;
      if (!breaks(clause.demand, one.error)) continue;
      if (++bad == 1) first = fmt::format(": {} {}", name_of_error(one.error), one.detail);
    }
    if (replies == 0 && bad == 0) return;
    std::string seen = fmt::format("{} of {} replies break it{}", bad, replies, first);
    if (discarded != 0) seen += fmt::format("; {} frames of the stream were discarded", discarded);
    conclude(result, bad == 0, std::move(seen));
  }
  static std::string_view name_of_error(Error error) { return error_texts[static_cast<std::size_t>(error)].name; }

  // Silence tells only of an encoder that answers else.
  [[nodiscard]] bool answers() const {
    return std::any_of(exchanges_.begin(), exchanges_.end(),
                       [](const Attempted& one) { return one.error == Error::none; });
  }

  void test_foreign(ClauseResult& result) {
    if (!answers()) return;
    Options other = options_;
    for (std::size_t i = 0; i < unit_.options.size(); ++i) {
      const Option& option = unit_.options[i];
      if (option.role != Role::encoder) continue;
      other.values[i] = option.maximum == options_.values[i] ? option.minimum : option.maximum;
      const Attempted one = once(other);
      // On CAN not what comes counts, but what would be an answer: a node may say something else at any time.
      if constexpr (std::is_same_v<Item, CanFrame>) {
        conclude(result, one.error == Error::timeout,
                 fmt::format("address {}: {}", other.values[i], name_of_error(one.error)));
      } else {
        conclude(result, !one.answered, what_came(one));
      }
      return;
    }
  }

  static std::string what_came(const Attempted& one) {
    const Bytes reply = one.exchange.reply.bytes;
    return fmt::format("to {:02x} came {}", fmt::join(one.exchange.request.bytes, " "),
                       reply.empty() ? "nothing" : fmt::format("{:02x}", fmt::join(reply, " ")));
  }
  Attempted send_instead(const std::function<void(std::vector<Item>&)>& edit) {
    runner_.edit = edit;
    Attempted one = once(options_);
    runner_.edit = {};
    return one;
  }

  void test_request(const Clause& clause, ClauseResult& result) {
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      if (!answers()) return;
      const Attempted one = send_instead([&](std::vector<std::uint8_t>& request) {
        if (clause.demand != Demand::damaged_silent) request.assign(1, clause.request);
        if (clause.demand == Demand::damaged_silent && !request.empty()) request.back() ^= 1;
      });
      const bool reported = clause.demand == Demand::unknown_reported;
      const std::size_t wanted = reported ? clause.reply_size : 0;
      conclude(result, one.exchange.reply.bytes.size() == wanted, what_came(one));
    }
  }

  // Nothing is changed by it that would have to be put back; but for turns that nothing but power keeps.
  void test_restart(const Clause& clause, ClauseResult& result) {
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      const Ran before = run(read_, {});
      if (!before.reading) return;
      if (before.reading->multiturn_bits != 0 && before.reading->multiturn != 0) {
        result.evidence = fmt::format("there are {} turns, which nothing could bring back", before.reading->multiturn);
        return;
      }
      std::vector<std::uint8_t> sent(longest_request);
      const auto size = unit_.encode(options_, *find_command(unit_, clause.command), {}, sent);
      if (!size) return;
      sent.resize(*size);
      send_instead([&](std::vector<std::uint8_t>& request) { request = sent; });
      const bool silent = !came(once(options_));
      runner_.listen(std::chrono::milliseconds(clause.value) + listening);
      const Ran after = run(read_, {});
      const bool there = after.reading && is_near(*after.reading, before.reading->singleturn);
      conclude(result, silent && there,
               fmt::format("it {} at once; later {}", silent ? "does not answer" : "answers",
                           after.reading ? fmt::format("position {}, {} before", after.reading->singleturn,
                                                       before.reading->singleturn)
                                         : std::string("no position was told")));
    }
  }

  const Unit& unit_;
  Options options_;
  Time latency_;
  Runner<Item> runner_;
  const Command& read_;
  std::size_t count_;
  bool ended_ = false;  // because of the choice `over`
  std::vector<Attempted> exchanges_;
};

ClauseResult untested(const Unit& unit, const Clause& clause) {
  return {.id = clause.id,
          .document = unit.document,
          .paragraph = clause.paragraph,
          .words = clause.words,
          .verdict = Verdict::untested,
          .evidence = "nothing came that would tell"};
}

[[noreturn]] void tell_left(std::string_view why, const std::vector<std::string>& left) {
  throw Failure(fmt::format("{}\nthe encoder is left changed; to put it back:\n  {}", why, fmt::join(left, "\n  ")));
}

template <class Item>
void test_all(const EncoderAddress& address, Port<Item>& port, Time latency, const ConformChoices& choices,
              std::string_view name, Conformance& conformance) {
  Tester<Item> tester(address, port, latency, choices);
  Changes changes(*address.unit, name, tester.line());
  try {
    tester.read();
    for (const Clause& clause : clauses_of(*address.unit)) {
      if (changes_encoder(clause.demand) && !choices.changes) continue;
      ClauseResult result = untested(*address.unit, clause);
      if (changes_encoder(clause.demand) && clause.demand != Demand::restarts) {
        changes.test(clause, result);
      } else {
        tester.test(clause, result);
      }
      conformance.clauses.push_back(std::move(result));
    }
  } catch (const os::Interrupted&) {
    if (!changes.left().empty()) tell_left("interrupted", changes.left());
    if (tester.ended()) throw Cancelled{};
    throw;
  } catch (const std::exception& error) {
    if (!changes.left().empty()) tell_left(error.what(), changes.left());
    throw;
  }
  conformance.left = changes.left();
}

}  // namespace

Conformance conform(const EncoderAddress& address, Link link, const ConformChoices& choices, std::string_view name) {
  if (clauses_of(*address.unit).empty()) throw UsageError(fmt::format("no clauses are known of {}", address.unit->id));
  Conformance conformance{.protocol = std::string(address.unit->id)};
  if (link.bytes != nullptr) {
    test_all(address, *link.bytes, link.latency, choices, name, conformance);
  } else {
    test_all(address, *link.frames, link.latency, choices, name, conformance);
  }
  return conformance;
}

Conformance conform(std::string_view text, std::span<const std::string> settings, const ConformChoices& choices) {
  const EncoderAddress address = parse_address(text, settings);
  std::string name = fmt::format("\"{}\"", text);
  for (const std::string& setting : settings) name += fmt::format(" --option {}", setting);
  return conform(address, open_link(address), choices, name);
}

}  // namespace absenc::client
