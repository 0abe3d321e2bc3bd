// SPDX-License-Identifier: Apache-2.0
// Tests the clauses that change an encoder, with mutants and with tests that end at any step.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "absenc/client/conform/changed_encoder_test.hpp"
#include "absenc/client/conform/mutant_test.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/host/session.hpp"
#include "absenc/os/error.hpp"
#include "absenc/protocol/all.hpp"
#include "tests/cases.hpp"

namespace absenc::client {
namespace {

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
    const ChangedEncoder<Item> good(address);
    const Conformance original = good.run(true);
    EXPECT_EQ(verdict_of(original, clause->id), Verdict::kept) << clause->id << "\n" << original.report();
    EXPECT_EQ(with_verdict(original, Verdict::broken), std::vector<std::string>{}) << original.report();
    unsigned alone = 0;
    unsigned broken = 0;
    std::string last;
    for (const Spoil<Item>& spoil : spoils_of<Item>(address, *clause, good.memory().size(), good.mutant->requests)) {
      ++tried;
      const ChangedEncoder<Item> bench(address);
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
  const ChangedEncoder<Item> whole(address);
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
    const ChangedEncoder<Item> bench(address);
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
  const ChangedEncoder<std::uint8_t> whole(address);
  const ByteList before = whole.memory();
  ASSERT_EQ(whole.run().verdict(), Verdict::kept);
  unsigned changed = 0;
  for (unsigned at = 1; at <= whole.port->steps; ++at) {
    const ChangedEncoder<std::uint8_t> bench(address);
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
    const Conformance good = ChangedEncoder<std::uint8_t>(address).run();
    EXPECT_EQ(verdict_of(good, one.clause), Verdict::kept) << good.report();
    EXPECT_NE(good.report().find(fmt::format("({})", one.compared)), std::string::npos) << good.report();
    for (int by = -4; by <= one.to; ++by) {
      if (by == 0) continue;
      bool broken = false;
      for (unsigned change = 1; change <= 12 && !broken; ++change) {
        const ChangedEncoder<std::uint8_t> bench(address);
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
  const ChangedEncoder<std::uint8_t> bench(parse_address("sim:tformat?singleturn=50000&multiturn=7"));
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
    const ChangedEncoder<std::uint8_t> bench(parse_address(text));
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
