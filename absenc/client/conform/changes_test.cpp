// SPDX-License-Identifier: Apache-2.0
// Tests the clauses that change an encoder, with mutants and with tests that end at any step.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absenc/client/conform/mutant_test.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/row.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/host/session.hpp"
#include "absenc/os/error.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/rough_line.hpp"
#include "tests/cases.hpp"

namespace absenc::client {
namespace {

using ByteList = std::vector<std::uint8_t>;

/// An encoder that ignores some requests, damages some replies or corrupts some writes.
template <class Item>
class Disobedient final : public Machine<Item> {
 public:
  using Kind = typename Event<Item>::Kind;

  explicit Disobedient(const VirtualDevice& device)
      : line_(machine_of<Item>(device)), device_(*device.device().template of<Item>()) {}

  void feed(const Event<Item>& event) override {
    // On a clocked link a request has no bytes, so each start of the clock counts as a request.
    if (event.kind == Kind::received || event.kind == Kind::selected) {
      ++requests;
      const bool is_ignored_now = requests >= ignored_from && requests < ignored_until;
      const bool is_ignored_request =
          !ignored_request.empty() &&
          std::equal(event.items.begin(), event.items.end(), ignored_request.begin(), ignored_request.end());
      if (is_ignored_now || (is_ignored_request && obeyed_++ >= obeyed_times)) return;
    }
    const ByteList before = memory();
    line_.feed(event);
    look(before);
  }
  Step<Item> next(Time now) override {
    const ByteList before = memory();
    Step<Item> step = line_.next(now);
    look(before);
    const bool is_damaged = damaged_at != 0 && requests == damaged_at;
    if (step.kind != Step<Item>::Kind::transfer || !is_damaged || step.out.empty()) return step;
    reply_.assign(step.out.begin(), step.out.end());
    if constexpr (std::is_same_v<Item, CanFrame>) {
      reply_.back().data[0] ^= 1;
    } else {
      reply_.back() ^= 1;
    }
    step.out = reply_;
    return step;
  }

  std::vector<Item> ignored_request{};  // request that the encoder ignores; empty: none
  unsigned obeyed_times = 0;            // number of times that the encoder obeys `ignored_request` before it ignores it
  // number, from 1, of the first request that the encoder ignores; 0 together with `ignored_until` 0: it ignores none
  unsigned ignored_from = 0;
  unsigned ignored_until = 0;  // number of the first request that the encoder does not ignore any more
  // number of the request whose reply gets a wrong bit; 0: no reply does
  unsigned damaged_at = 0;
  unsigned change = 0;      // number, from 1, of the memory change that `spoil` corrupts; 0: no change is corrupted
  bool spoils_all = false;  // whether `spoil` corrupts each change of the memory
  // corrupts the memory, given its new content and its previous content
  std::function<void(MutableBytes, const ByteList&)> spoil{};
  unsigned requests = 0;

 private:
  [[nodiscard]] ByteList memory() const { return {device_.memory().begin(), device_.memory().end()}; }
  void look(const ByteList& before) {
    if (std::equal(before.begin(), before.end(), device_.memory().begin())) return;
    if (++changes_ != change && !spoils_all) return;
    spoil(device_.memory(), before);
  }

  Machine<Item>& line_;
  Device<Item>& device_;
  unsigned changes_ = 0;
  unsigned obeyed_ = 0;
  std::vector<Item> reply_;
};

/// A port that calls `end` in its wait number `at`, counted from 1; if `lost` is set, the line is lost after that.
template <class Item>
class EndingPort final : public Port<Item> {
 public:
  explicit EndingPort(Port<Item>& port) : port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const Step<Item>& step) override { port_.begin(step); }
  Event<Item> wait(const Step<Item>& step) override {
    if (++steps == at && end) end();
    if (lost && steps >= at) throw os::Failure(os::Failure::Kind::lost, "the line is lost");
    return port_.wait(step);
  }

  unsigned steps = 0;
  unsigned at = 0;
  bool lost = false;
  std::function<void()> end{};

 private:
  Port<Item>& port_;
};

template <class Item>
struct Bench {
  explicit Bench(const EncoderAddress& where) : address(where) {
    link.device = std::make_unique<VirtualDevice>(*address.unit, address.options, address.device);
    link.device->power_on(Time{});
    device = link.device->device().template of<Item>();
    mutant = std::make_unique<Disobedient<Item>>(*link.device);
    line = std::make_unique<sim::RoughLine<Item>>(address.unit->link, address.line.with_some_rate(), *mutant, 1);
    port = std::make_unique<EndingPort<Item>>(*line);
  }
  [[nodiscard]] ByteList memory() const { return {device->memory().begin(), device->memory().end()}; }
  /// Returns position and settings as text. The memory is left out, because an encoder may count its writes in it.
  [[nodiscard]] std::string settings() const {
    // Sets the port to the baud rate of the address and waits for 2 s: the conformance test may have ended while the
    // line had another baud rate, or just after a restart of the encoder.
    line->begin({.kind = Step<Item>::Kind::configure, .rate = address.line.with_some_rate().rate});
    const Step<Item> rest{.at = line->now() + std::chrono::seconds(2)};
    while (line->now() < rest.at && line->wait(rest).kind != Event<Item>::Kind::timer) {
    }
    std::string text;
    const auto add_value = [&](const Command& command, std::string_view field) {
      std::vector<std::byte> storage(address.unit->host_storage);
      host::Session<Item> session(*address.unit, address.options, *line, storage);
      const Conversation<Item>* ended = session.run(command);
      AnswerSink sink;
      ended->report(sink);
      EXPECT_EQ(ended->error(), Error::none) << command.name << " of an encoder that conform has left";
      if (ended->error() != Error::none) return;
      text += fmt::format("{} {}\n", command.name, to_text(sink.answer[field]));
    };
    for (const Clause& clause : clauses_of(*address.unit)) {
      if (!clause.field.empty()) add_value(*find_command(*address.unit, clause.setting), clause.field);
    }
    const auto position = std::ranges::find(address.unit->fields, Role::position, &FieldInfo::role);
    if (position != address.unit->fields.end()) add_value(*find_command(*address.unit, Verb::read), position->name);
    return text;
  }
  // Runs the conformance test on a link that does not own `device`, because `device` is inspected after the test.
  [[nodiscard]] Conformance run(bool resets = false, const std::function<bool()>& over = {}) const {
    Link port_link;
    if constexpr (std::is_same_v<Item, CanFrame>) {
      port_link.frames = port.get();
    } else {
      port_link.bytes = port.get();
    }
    return conform(address, std::move(port_link), {.readings = 3, .changes = true, .resets = resets, .over = over},
                   "NAME");
  }

  EncoderAddress address;
  Link link;
  Device<Item>* device = nullptr;
  std::unique_ptr<Disobedient<Item>> mutant;
  std::unique_ptr<sim::RoughLine<Item>> line;
  std::unique_ptr<EndingPort<Item>> port;
};

std::vector<const Clause*> changing(const Unit& unit) {
  std::vector<const Clause*> clauses;
  for (const Clause& clause : clauses_of(unit)) {
    if (changes_encoder(clause.demand)) clauses.push_back(&clause);
  }
  return clauses;
}

/// Returns the address of an encoder whose position is neither zero nor its own mirror image.
EncoderAddress address_of_unit(const Unit& unit, std::string_view more = {}) {
  const std::string text = fmt::format("sim:{}?{}", unit.id, more);
  const Resolution resolution = unit.resolution(parse_address(text).options);
  return parse_address(fmt::format("{}{}singleturn={}", text, more.empty() ? "" : "&",
                                   (std::uint64_t{1} << resolution.singleturn_bits) / 3));
}
EncoderAddress address_showing_change(const Unit& unit, const Clause& clause) {
  std::string more(clause.shown_with);
  const auto add = [&](const std::string& setting) { more += (more.empty() ? "" : "&") + setting; };
  if (clause.demand == Demand::reset) {
    if (clause.verb == Verb::reset_multiturn) add("multiturn=7");
    for (unsigned bit = 0; bit < 32; ++bit) {
      if ((clause.value >> bit & 1) == 0) continue;
      add(fmt::format("alarm={}", unit.alarms->flags[bit].name));
      break;
    }
  }
  return address_of_unit(unit, more);
}

template <class Item>
using Spoil = std::function<void(Disobedient<Item>&)>;

template <class Item>
std::vector<Item> request_of(const EncoderAddress& address, const Command& command, Arguments given = {}) {
  ByteList request(64);
  const auto size = address.unit->encode(address.options, command, complete_arguments(command, given), request);
  if (!size) return {};
  request.resize(*size);
  if constexpr (std::is_same_v<Item, CanFrame>) {
    return {*parse_wire_text(LinkKind::can, "a request", {reinterpret_cast<char*>(request.data()), *size}).can};
  } else {
    return request;
  }
}

template <class Item>
std::vector<Spoil<Item>> spoils_of(const EncoderAddress& address, const Clause& clause, std::size_t memory,
                                   unsigned requests) {
  using Encoder = Disobedient<Item>;
  std::vector<Spoil<Item>> all;
  if (loses(clause.demand)) {
    const Verb verb = clause.demand == Demand::zero ? Verb::zero : clause.verb;
    const Command* const command =
        clause.command.empty() ? find_command(*address.unit, verb) : find_command(*address.unit, clause.command);
    const std::vector<Item> request = request_of<Item>(address, *command);
    for (unsigned before = 0; before < 10 && !request.empty(); ++before) {
      all.push_back([=](Encoder& one) {
        one.ignored_request = request;
        one.obeyed_times = before;
      });
    }
  }
  const auto add_ignored = [&](const Command& command, Arguments given) {
    const std::vector<Item> request = request_of<Item>(address, command, given);
    if (!request.empty()) all.push_back([=](Encoder& one) { one.ignored_request = request; });
  };
  if (clause.demand == Demand::set || clause.demand == Demand::mirrored) {
    const Command& setter = *require_setting(*address.unit, clause.setting).setter;
    for (const std::int64_t value : {clause.value, clause.other}) add_ignored(setter, std::array{value});
  }
  if (clause.demand == Demand::paced) {
    add_ignored(*find_command(*address.unit, clause.command), std::array{clause.value});
    add_ignored(*find_command(*address.unit, clause.stop), {});
  }
  const bool by_itself = clause.demand == Demand::byte_busy || clause.demand == Demand::page_closed;
  for (unsigned at = 1; by_itself && at <= requests; ++at) {
    all.push_back([=](Encoder& one) {
      one.ignored_from = at;
      one.ignored_until = at + 1;
    });
    all.push_back([=](Encoder& one) { one.damaged_at = at; });
  }
  // Spoiling a byte of the memory breaks no clause about a setting that is not in the memory.
  const unsigned step = address.unit->link == LinkKind::clocked ? 20 : 5;
  for (const unsigned window : {30u, 1000u}) {
    for (unsigned from = 1; clause.demand >= Demand::set && from <= requests; from += step) {
      all.push_back([=](Encoder& one) {
        one.ignored_from = from;
        // the encoder ignores more requests than a host sends when it repeats one request
        one.ignored_until = from + window;
      });
    }
  }
  const bool of_memory = clause.demand < Demand::set || loses(clause.demand);
  for (unsigned change = 1; change <= 12 && of_memory && !by_itself; ++change) {
    all.push_back([=](Encoder& one) {
      one.change = change;
      one.spoil = [](MutableBytes now, const ByteList& before) {
        std::copy(before.begin(), before.end(), now.begin());
      };
    });
    for (std::size_t at = 0; at < std::min<std::size_t>(memory, 300); ++at) {
      all.push_back([=](Encoder& one) {
        one.change = change;
        one.spoil = [at](MutableBytes now, const ByteList&) { now[at] ^= 0x55; };
      });
    }
  }
  return all;
}

template <class Item>
void check_mutants(const Unit& unit) {
  std::size_t tried = 0;
  for (const Clause* const clause : changing(unit)) {
    const EncoderAddress address = address_showing_change(unit, *clause);
    const Bench<Item> good(address);
    const Conformance original = good.run(true);
    EXPECT_EQ(verdict_of(original, clause->id), Verdict::kept) << clause->id << "\n" << original.report();
    EXPECT_EQ(with_verdict(original, Verdict::broken), std::vector<std::string>{}) << original.report();
    unsigned alone = 0;
    unsigned broken = 0;
    std::string last;
    for (const Spoil<Item>& spoil : spoils_of<Item>(address, *clause, good.memory().size(), good.mutant->requests)) {
      ++tried;
      const Bench<Item> bench(address);
      spoil(*bench.mutant);
      const Conformance mutant = bench.run(true);
      last = mutant.report();
      if (verdict_of(mutant, clause->id) != Verdict::broken) continue;
      ++broken;
      alone += with_verdict(mutant, Verdict::broken).size() == 1 ? 1 : 0;
      if (alone >= 1 && broken >= 2) break;
    }
    EXPECT_GE(alone, 1U) << clause->id << "\n" << last;
    EXPECT_GE(broken, 2U) << clause->id << "\n" << last;
  }
  std::printf("%s: %zu clauses that change, %zu mutants\n", std::string(unit.id).c_str(), changing(unit).size(), tried);
}

template <class Item>
void check_ends(const EncoderAddress& address) {
  const Bench<Item> whole(address);
  const ByteList before = whole.memory();
  const Conformance original = whole.run();
  ASSERT_EQ(original.verdict(), Verdict::kept) << original.report();
  const unsigned steps = whole.port->steps;
  const std::string settings = whole.settings();
  // If even a complete test leaves the memory changed, the encoder counts its writes in the memory.
  const bool counts = whole.memory() != before;
  // A test with many steps is ended at each of them in only one of the three ways: interrupt, short loss of the line,
  // or cancellation.
  const unsigned kinds = steps < 1000 ? 3 : 1;
  const unsigned stride = 10 / test_cases(10);
  for (unsigned i = 0; i < steps * kinds; i += stride) {
    const unsigned at = 1 + i / kinds;
    const unsigned kind = i % 3;
    const Bench<Item> bench(address);
    bench.port->at = at;
    bool over = false;
    bench.port->end = [&] {
      if (kind == 0) throw os::Interrupted{};
      if (kind == 1) throw os::Failure(os::Failure::Kind::lost, "the line is lost for a moment");
      over = true;
    };
    bool ended = false;
    try {
      static_cast<void>(bench.run(false, [&] { return over; }));
    } catch (const os::Interrupted&) {
      ended = kind == 0;
    } catch (const os::Failure&) {
      ended = kind == 1;
    } catch (const Cancelled&) {
      ended = kind == 2;
    }
    // A short loss of the line is harmless while values are being restored.
    EXPECT_TRUE(ended || kind != 0) << at;
    if (!counts) {
      ASSERT_EQ(bench.memory(), before) << "end " << kind << " at " << at << " of " << steps;
    }
    ASSERT_EQ(bench.settings(), settings) << "end " << kind << " at " << at << " of " << steps;
  }
  std::printf("%s: ended at each of %u steps\n", std::string(address.unit->id).c_str(), steps);
}

class ChangingClauses : public ::testing::TestWithParam<const Unit*> {};

TEST_P(ChangingClauses, EachClauseIsBrokenByTwoMutantsOneAlone) {
  if (GetParam()->link == LinkKind::can) {
    check_mutants<CanFrame>(*GetParam());
  } else {
    check_mutants<std::uint8_t>(*GetParam());
  }
}

TEST_P(ChangingClauses, RestoreSettingsAfterEndAtAnyStep) {
  const EncoderAddress address = address_of_unit(*GetParam());
  if (GetParam()->link == LinkKind::can) {
    check_ends<CanFrame>(address);
  } else {
    check_ends<std::uint8_t>(address);
  }
}

INSTANTIATE_TEST_SUITE_P(Units, ChangingClauses, ::testing::ValuesIn([] {
                           std::vector<const Unit*> units;
                           for (const Unit* unit : all_units()) {
                             if (!changing(*unit).empty()) units.push_back(unit);
                           }
                           return units;
                         }()),
                         [](const auto& one) { return test_name(*one.param); });

TEST(Conformance, NamesCommandThatRestoresAfterLostLine) {
  const EncoderAddress address = parse_address("sim:tformat");
  const Bench<std::uint8_t> whole(address);
  const ByteList before = whole.memory();
  ASSERT_EQ(whole.run().verdict(), Verdict::kept);
  unsigned changed = 0;
  for (unsigned at = 1; at <= whole.port->steps; ++at) {
    const Bench<std::uint8_t> bench(address);
    bench.port->at = at;
    bench.port->lost = true;
    std::string words;
    try {
      static_cast<void>(bench.run());
    } catch (const std::exception& error) {
      words = error.what();
    }
    if (bench.memory() == before) continue;
    ++changed;
    EXPECT_NE(words.find(fmt::format("absenc memory write NAME 0x7E 0x{:02X} --page 0", before[0x7E])),
              std::string::npos)
        << at << ": " << words;
  }
  EXPECT_GT(changed, 4U);
}

// Result of a zero: its error, and what the session knows of the change.
struct Zeroed {
  Error error;
  ChangeSent change;
  std::string note;
};

// Sets the zero of an encoder at the position `counts`. `is_ignored`: the encoder replies, but stores nothing.
template <class Item>
Zeroed zero_at(const Unit& unit, std::uint64_t counts, bool is_ignored) {
  const Bench<Item> bench(parse_address(fmt::format("sim:{}?singleturn={}", unit.id, counts)));
  const Command& zero = *find_command(unit, Verb::zero);
  if (is_ignored) {
    bench.mutant->spoils_all = true;
    bench.mutant->spoil = [](MutableBytes now, const ByteList& before) {
      std::copy(before.begin(), before.end(), now.begin());
    };
  }
  std::vector<std::byte> storage(unit.host_storage);
  host::Session<Item> session(unit, bench.address.options, *bench.line, storage);
  const Conversation<Item>* const ended = session.run(zero, complete_arguments(zero, {}));
  return {ended->error(), session.change_sent(), std::string(session.change_note())};
}

// An encoder that ignores the zero, and stands so near to it that the position read back is right nevertheless.
TEST(Zero, IsNotConfirmedIfItCouldHaveBeenIgnored) {
  unsigned unproven = 0;
  for (const Unit* const unit : all_units()) {
    if (find_command(*unit, Verb::zero) == nullptr) continue;
    const EncoderAddress address = parse_address(fmt::format("sim:{}", unit->id));
    const std::uint64_t turn = std::uint64_t{1} << unit->resolution(address.options).singleturn_bits;
    const auto at = [&](std::uint64_t counts, bool is_ignored) {
      return unit->link == LinkKind::can ? zero_at<CanFrame>(*unit, counts, is_ignored)
                                         : zero_at<std::uint8_t>(*unit, counts, is_ignored);
    };
    if (at(turn / 3, false).error == Error::unsupported) continue;
    const Zeroed obeyed = at(turn / 3, false);
    EXPECT_EQ(obeyed.error, Error::none) << unit->id;
    EXPECT_EQ(obeyed.change, ChangeSent::yes) << unit->id;
    EXPECT_EQ(obeyed.note, "") << unit->id;
    const Zeroed ignored = at(turn / 3, true);
    if (ignored.error == Error::none) continue;  // this virtual encoder has its zero not only in its memory
    EXPECT_EQ(ignored.change, ChangeSent::refused) << unit->id;
    const Zeroed near = at(std::max<std::uint64_t>(turn >> 15, 1), true);
    EXPECT_TRUE(near.error != Error::none || near.change != ChangeSent::yes) << unit->id;
    if (near.change == ChangeSent::unproven) {
      ++unproven;
      EXPECT_NE(near.note.find("turn the shaft and try again"), std::string::npos) << unit->id << ": " << near.note;
    }
  }
  EXPECT_GE(unproven, 5U);
}

// Each byte beside the written one is compared, before and behind it, as far as its area of the memory reaches.
TEST(Conformance, ByteBesideIsComparedOnBothSides) {
  struct Case {
    const char* text;
    const char* clause;
    const char* compared;
    int to;  // distance of the last byte behind it that is compared
  };
  for (const Case& one : {Case{"sim:hiperface?model=SKM36", "data-beside", "page 0: 0x7A to 0x7D, 0x7F", 1},
                          Case{"sim:tformat", "eeprom-beside", "page 0: 0x7A to 0x7D", 0}}) {
    const EncoderAddress address = parse_address(one.text);
    const Conformance good = Bench<std::uint8_t>(address).run();
    EXPECT_EQ(verdict_of(good, one.clause), Verdict::kept) << good.report();
    EXPECT_NE(good.report().find(fmt::format("({})", one.compared)), std::string::npos) << good.report();
    for (int by = -4; by <= one.to; ++by) {
      if (by == 0) continue;
      bool broken = false;
      for (unsigned change = 1; change <= 12 && !broken; ++change) {
        const Bench<std::uint8_t> bench(address);
        bench.mutant->change = change;
        bench.mutant->spoil = [by](MutableBytes now, const ByteList& before) {
          const auto written = std::mismatch(before.begin(), before.end(), now.begin()).second;
          *(written + by) ^= 0x55;
        };
        broken = verdict_of(bench.run(), one.clause) == Verdict::broken;
      }
      EXPECT_TRUE(broken) << one.text << " " << by;
    }
  }
}

TEST(Conformance, EvidenceSaysHowPositionsAreCompared) {
  const Bench<std::uint8_t> bench(parse_address("sim:tformat?singleturn=50000&multiturn=7"));
  const Conformance found = bench.run(true);
  for (const char* const id : {"zero", "reset-multiturn"}) {
    const auto clause = std::ranges::find(found.clauses, id, &ClauseResult::id);
    EXPECT_EQ(clause->verdict, Verdict::kept) << found.report();
    EXPECT_NE(clause->evidence.find("positions are compared to within 1/512 turn"), std::string::npos)
        << clause->evidence;
  }
}

TEST(Conformance, ErasesZeroTurnsAndAlarmsOnlyWithResets) {
  const auto found = [](std::string_view text, bool resets) {
    const Bench<std::uint8_t> bench(parse_address(text));
    const Conformance conformance = bench.run(resets);
    std::array<Verdict, 3> verdicts{};
    std::ranges::transform(std::array{"zero", "clear-alarms", "reset-multiturn"}, verdicts.begin(),
                           [&](std::string_view id) { return verdict_of(conformance, id); });
    const Reading after = [&] {
      std::vector<std::byte> storage(bench.address.unit->host_storage);
      host::Session<std::uint8_t> session(*bench.address.unit, bench.address.options, *bench.line, storage);
      const Conversation<std::uint8_t>* ended = session.run(*find_command(*bench.address.unit, Verb::read));
      return *ended->reading();
    }();
    return std::pair(verdicts, after);
  };
  constexpr auto kept = Verdict::kept;
  constexpr auto untested = Verdict::untested;
  for (const char* const unit : {"tformat", "esl"}) {
    const std::string alarm = std::string_view(unit) == "esl" ? "xc_error" : "over_speed";
    const std::string text = fmt::format("sim:{}?singleturn=50000&multiturn=7&alarm={}", unit, alarm);
    const auto [left_alone, as_before] = found(text, false);
    EXPECT_EQ(left_alone, (std::array{untested, untested, untested})) << unit;
    EXPECT_EQ(as_before.singleturn, 50000U);
    EXPECT_EQ(as_before.multiturn, 7U);
    EXPECT_NE(as_before.alarms, 0U);
    EXPECT_EQ(found(fmt::format("sim:{}", unit), true).first, (std::array{untested, untested, untested})) << unit;
  }
  const auto [given_up, after] = found("sim:tformat?singleturn=50000&multiturn=7&alarm=over_speed", true);
  EXPECT_EQ(given_up, (std::array{kept, kept, kept}));
  EXPECT_EQ(after.multiturn, 0U);
  EXPECT_EQ(after.alarms, 0U);
}

}  // namespace
}  // namespace absenc::client
