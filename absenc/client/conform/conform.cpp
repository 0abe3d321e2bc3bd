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
#include "absenc/client/conform/edited_port.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/session.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

namespace {

constexpr Time listening = std::chrono::milliseconds(20);  // for what comes though nobody waits for it any more
constexpr std::size_t longest_request = 64;

struct Exchange {
  Error error = Error::none;
  std::string detail;
  bool came = false;
  Time after{};
  Time limit{};
};

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
        echo_(address.echo),
        port_(port),
        storage_(unit_.host_storage),
        read_(*find_command(unit_, Verb::read)) {
    if (unit_.link == LinkKind::half_duplex || unit_.link == LinkKind::full_duplex) {
      port_.character = address.line.with_some_rate().character();
    }
    port_.over = choices.over;
    watched_.attach(port_);
    watched_.abort = [this] { return session_ != nullptr && session_->abort(); };
  }

  void read(std::size_t count) {
    find_echo();
    for (std::size_t i = 0; i < count; ++i) exchanges_.push_back(once(options_));
  }

  [[nodiscard]] bool ended() const { return port_.ended; }

  [[nodiscard]] ChangesLine line() {
    return {.run = [this](const Command& command, Arguments arguments) { return run(command, arguments); },
            .rest = [this](Time time) { port_.listen(time); },
            .follow =
                [this](const Command& setter, std::int64_t value) {
                  options_ = options_behind(unit_, options_, setter, value);
                  watched_.return_to(line_settings(unit_, options_).rate);
                }};
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
    host::Session<Item> session(unit_, options_, watched_, storage_, echo_);
    session_ = &session;
    watched_.return_to(line_settings(unit_, options_).rate);
    struct Forget {
      host::Session<Item>*& session;
      ~Forget() { session = nullptr; }
    } const forget{session_};
    const Conversation<Item>* ended = session.run(command, arguments);
    if (watched_.take_aborted()) throw os::Interrupted{};
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

  // Whether the adapter echoes, from a good exchange; where none is, it does not.
  void find_echo() {
    constexpr unsigned attempts = 5;
    for (unsigned i = 0; i < attempts && echo_ == host::EchoMode::automatic; ++i) {
      host::Session<Item> session(unit_, options_, port_, storage_, echo_, 1);
      (void)session.run(read_);
      echo_ = session.echo().mode();
    }
    if (echo_ == host::EchoMode::automatic) echo_ = host::EchoMode::off;
    port_.echoes = echo_ == host::EchoMode::on;
  }

  // With a session of its own: what one owes is nothing to the next.
  Exchange once(const Options& options) {
    host::Session<Item> session(unit_, options, port_, storage_, echo_, 1);
    port_.forget();
    const Conversation<Item>* ended = session.run(read_);
    if (ended == nullptr) throw UsageError(fmt::format("{} cannot be read with these options", unit_.id));
    Exchange one{.error = ended->error(), .detail = std::string(ended->detail())};
    // What a host makes of silence is no matter of what came.
    if (one.error != Error::none && is_asked() && port_.received.empty()) one.error = Error::timeout;
    if (one.error != Error::none && is_asked()) port_.listen(listening);
    // One that comes when the host has asked again is late, not missing.
    const bool late = port_.after > port_.answer + latency_;
    one.came = !port_.received.empty() && (port_.unanswered == 0 || late) && one.error != Error::line_stuck;
    one.after = port_.after;
    one.limit = port_.answer + latency_;
    return one;
  }
  // Else the host is the clock.
  [[nodiscard]] bool is_asked() const { return unit_.link != LinkKind::clocked && unit_.link != LinkKind::spi; }

  void test_answered(ClauseResult& result) const {
    const auto came = std::count_if(exchanges_.begin(), exchanges_.end(), [](const Exchange& one) { return one.came; });
    conclude(result, came == std::ssize(exchanges_), fmt::format("{} of {} answered", came, exchanges_.size()));
  }

  void test_time(ClauseResult& result) const {
    std::optional<Exchange> worst;
    for (const Exchange& one : exchanges_) {
      if (one.came && one.limit > Time{} && (!worst || one.after > worst->after)) worst = one;
    }
    if (!worst) return;
    const auto us = [](Time time) { return std::chrono::duration<double, std::micro>(time).count(); };
    std::string seen =
        fmt::format("at most {:.1f} us, of {:.1f} us that a host waits", us(worst->after), us(worst->limit));
    if (latency_ > Time{}) seen += fmt::format("; this port tells it to within {:.1f} us", us(latency_));
    conclude(result, worst->after <= worst->limit, std::move(seen));
  }

  [[nodiscard]] std::vector<Exchange> read_with(std::string_view option, std::int64_t value) {
    Options other = options_;
    for (std::size_t i = 0; i < unit_.options.size(); ++i) {
      if (unit_.options[i].name == option) other.values[i] = value;
    }
    std::vector<Exchange> exchanges;
    for (std::size_t i = 0; i < exchanges_.size(); ++i) exchanges.push_back(once(other));
    return exchanges;
  }

  void test_frames(const Clause& clause, ClauseResult& result) {
    const std::vector<Exchange> exchanges = clause.option.empty() ? exchanges_ : read_with(clause.option, clause.value);
    std::size_t came = 0;
    std::size_t bad = 0;
    std::string first;
    for (const Exchange& one : exchanges) {
      came += one.came ? 1 : 0;
      if (!breaks(clause.demand, one.error)) continue;
      if (++bad == 1) first = fmt::format(": {} {}", name_of_error(one.error), one.detail);
    }
    if (came == 0 && bad == 0) return;
    conclude(result, bad == 0, fmt::format("{} of {} replies break it{}", bad, came, first));
  }
  static std::string_view name_of_error(Error error) { return error_texts[static_cast<std::size_t>(error)].name; }

  // Silence tells only of an encoder that answers else.
  [[nodiscard]] bool answers() const {
    return std::any_of(exchanges_.begin(), exchanges_.end(),
                       [](const Exchange& one) { return one.error == Error::none; });
  }

  void test_foreign(ClauseResult& result) {
    if (!answers()) return;
    Options other = options_;
    for (std::size_t i = 0; i < unit_.options.size(); ++i) {
      const Option& option = unit_.options[i];
      if (option.role != Role::encoder) continue;
      other.values[i] = option.maximum == options_.values[i] ? option.minimum : option.maximum;
      std::vector<Item> sent;
      port_.edit = [&](std::vector<Item>& request) { sent = request; };
      const Exchange one = once(other);
      port_.edit = {};
      // On CAN not what comes counts, but what would be an answer: a node may say something else at any time.
      if constexpr (std::is_same_v<Item, CanFrame>) {
        conclude(result, one.error == Error::timeout,
                 fmt::format("address {}: {}", other.values[i], name_of_error(one.error)));
      } else {
        conclude(result, port_.received.empty(), what_came(sent, port_.received));
      }
      return;
    }
  }

  static std::string what_came(Bytes sent, Bytes came) {
    return fmt::format("to {:02x} came {}", fmt::join(sent, " "),
                       came.empty() ? "nothing" : fmt::format("{:02x}", fmt::join(came, " ")));
  }

  void test_request(const Clause& clause, ClauseResult& result) {
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      if (!answers()) return;
      std::vector<std::uint8_t> sent;
      port_.edit = [&](std::vector<std::uint8_t>& request) {
        if (clause.demand != Demand::damaged_silent) request.assign(1, clause.request);
        if (clause.demand == Demand::damaged_silent && !request.empty()) request.back() ^= 1;
        sent = request;
      };
      once(options_);
      port_.edit = {};
      const std::vector<std::uint8_t>& came = port_.received;
      if (clause.demand == Demand::unknown_reported) {
        conclude(result, came.size() == clause.reply_size, what_came(sent, came));
      } else {
        conclude(result, came.empty(), what_came(sent, came));
      }
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
      port_.edit = [&](std::vector<std::uint8_t>& request) { request = sent; };
      once(options_);
      port_.edit = {};
      const bool silent = !once(options_).came;
      port_.listen(std::chrono::milliseconds(clause.value) + listening);
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
  host::EchoMode echo_;
  EditedPort<Item> port_;
  WatchedPort<Item> watched_;
  host::Session<Item>* session_ = nullptr;  // of the command that runs
  std::vector<std::byte> storage_;
  const Command& read_;
  std::vector<Exchange> exchanges_;
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
    tester.read(std::max<std::size_t>(1, choices.readings));
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
