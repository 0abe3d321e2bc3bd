// SPDX-License-Identifier: Apache-2.0
// Checks clauses that change no encoder: the virtual encoder keeps them, mutants break them.
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absenc/client/conform/clause_mutants_test.hpp"
#include "absenc/client/conform/tester.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

using namespace std::chrono_literals;

// Returns whether the mutant breaks no clause except `clause`. Clauses about commands (Demand::does) may break
// together.
bool breaks_only(const Unit& unit, const Clause& clause, const std::vector<std::string>& broken) {
  return std::all_of(broken.begin(), broken.end(), [&](const std::string& id) {
    const auto other = std::ranges::find(clauses_of(unit), id, &Clause::id);
    return id == clause.id || (clause.demand == Demand::does && other->demand == Demand::does);
  });
}

template <class Item>
void check(const Unit& unit) {
  std::size_t tried = 0;
  std::size_t clauses = 0;
  for (const Clause& clause : clauses_of(unit)) {
    if (changes_encoder(clause.demand)) continue;
    ++clauses;
    const std::size_t tried_before = tried;
    const EncoderAddress address = parse_address(address_showing(unit, clause));
    const Conformance good = conform_mutant<Item>(address, {}, {.readings = 8});
    EXPECT_EQ(verdict_of(good, clause.id), Verdict::kept) << clause.id << "\n" << good.report();
    EXPECT_EQ(with_verdict(good, Verdict::broken), std::vector<std::string>{}) << good.report();
    unsigned alone = 0;
    unsigned broken = 0;
    std::string last;
    for (const ReplyChange<Item>& change : mutants_of<Item>(address, clause)) {
      ++tried;
      const Conformance mutant = conform_mutant<Item>(address, change, {.readings = 8});
      const std::vector<std::string> ids = with_verdict(mutant, Verdict::broken);
      last = mutant.report();
      if (verdict_of(mutant, clause.id) != Verdict::broken) continue;
      ++broken;
      alone += breaks_only(unit, clause, ids) ? 1 : 0;
      if (alone >= 1 && broken >= 2) break;
    }
    const std::string counts = fmt::format(
        "{}: {} of {} changed encoders break the clause \"{}\", and two must; {} break it alone, and one "
        "must. The last verdict:\n{}",
        unit.id, broken, tried - tried_before, clause.id, alone, last);
    EXPECT_GE(alone, 1U) << counts;
    EXPECT_GE(broken, 2U) << counts;
  }
  std::printf("%s: %zu clauses, %zu mutants\n", std::string(unit.id).c_str(), clauses, tried);
}

class Clauses : public ::testing::TestWithParam<const Unit*> {};

TEST_P(Clauses, EachClauseIsBrokenByTwoMutantsOneAlone) {
  const Unit& unit = *GetParam();
  if (clauses_of(unit).empty()) GTEST_SKIP() << "no clauses are known";
  if (unit.link == LinkKind::can) {
    check<CanFrame>(unit);
  } else {
    check<std::uint8_t>(unit);
  }
}

template <class Item>
void check_kept(const EncoderAddress& address, std::set<std::string>& seen) {
  const Unit& unit = *address.unit;
  try {
    const Conformance good = conform_mutant<Item>(address, {}, {.readings = 3});
    // If an earlier encoder had the same report, the mutants are not tested again.
    if (!seen.insert(good.report()).second) return;
    for (const Clause& clause : clauses_of(unit)) {
      if (verdict_of(good, clause.id) != Verdict::kept) continue;
      bool broken = false;
      for (const ReplyChange<Item>& change : mutants_of<Item>(address, clause)) {
        broken = verdict_of(conform_mutant<Item>(address, change, {.readings = 3}), clause.id) == Verdict::broken;
        if (broken) break;
      }
      EXPECT_TRUE(broken) << variation_name(address) << ": no changed encoder breaks the clause \"" << clause.id
                          << "\", which this encoder keeps\n"
                          << good.report();
    }
  } catch (const UsageError&) {  // skips option values with which no host can read the encoder
  }
}

TEST_P(Clauses, EachKeptClauseCanBeBroken) {
  const Unit& unit = *GetParam();
  std::set<std::string> seen;
  for (const EncoderAddress& address : variations_of(unit)) {
    if (unit.link == LinkKind::can) {
      check_kept<CanFrame>(address, seen);
    } else {
      check_kept<std::uint8_t>(address, seen);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Units, Clauses, ::testing::ValuesIn(all_units().begin(), all_units().end()),
                         [](const auto& one) { return test_name(*one.param); });

TEST(Conformance, EchoOfAdapterIsNoReply) {
  for (const char* const text : {"sim:tformat?echo=auto", "sim:tformat?echo=on", "sim:amt21?echo=auto"}) {
    const EncoderAddress address = parse_address(text);
    for (const bool silent : {false, true}) {
      Link link;
      link.device = std::make_unique<VirtualDevice>(*address.unit, address.options, address.device);
      link.device->power_on(Time{});
      Mutant<std::uint8_t> mutant(*link.device->bytes(), address.unit->link);
      mutant.mutated = 7;
      if (silent) mutant.change_reply = [](std::vector<std::uint8_t>& reply_items, ByteStep&) { reply_items.clear(); };
      sim::SimPort<std::uint8_t> line(address.unit->link, address.line.with_some_rate(), mutant);
      line.set_echo(true);
      link.bytes = &line;
      const Conformance found = conform(address, std::move(link), {.readings = 8});
      EXPECT_EQ(found.verdict() == Verdict::kept, !silent) << text << "\n" << found.report();
      if (silent) {
        EXPECT_EQ(found.clauses.front().verdict, Verdict::broken) << found.report();
        EXPECT_EQ(found.clauses.front().id, "answer");
      }
    }
  }
}

// The host of this unit repeats a request without reply, and the encoder answers the repetition.
TEST(Conformance, ReplyToRepeatedRequestIsNoReaction) {
  const EncoderAddress address = parse_address("sim:amt21");
  VirtualDevice device(*address.unit, address.options, address.device);
  device.power_on(Time{});
  sim::SimPort<std::uint8_t> port(address.unit->link, address.line.with_some_rate(), *device.bytes());
  Tester<std::uint8_t> tester(address, port, Time{}, {.readings = 2});
  tester.read();
  const Clause clause{.id = "other",
                      .paragraph = "",
                      .words = "",
                      .demand = Demand::reacts,
                      .ask = {.wire = "90"},
                      .reaction = Reaction::silent};
  ClauseResult result;
  tester.test(clause, result);
  EXPECT_EQ(result.verdict, Verdict::kept) << result.evidence;
  EXPECT_EQ(result.evidence, "3 of 3 times; to 90 came nothing");
}

// A late reply still counts as the answer to its request at 2400 baud, where its 7 characters take longer than 20 ms.
TEST(Conformance, LateReplyOnSlowLineIsReceived) {
  const ReplyChange<std::uint8_t> late{.change = [](Mutant<std::uint8_t>& mutant) {
    mutant.always = true;
    mutant.change_reply = [](std::vector<std::uint8_t>&, ByteStep& step) { step.at += 60ms; };
  }};
  const Conformance found =
      conform_mutant<std::uint8_t>(parse_address("sim:raa38-modbus?baud=2400"), late, {.readings = 8});
  EXPECT_EQ(verdict_of(found, "answer"), Verdict::kept) << found.report();
}

// Returns the results for an encoder of HIPERFACE each of whose replies is `delay` late.
Conformance conform_delayed(Time delay) {
  const ReplyChange<std::uint8_t> late{.change = [delay](Mutant<std::uint8_t>& mutant) {
    mutant.always = true;
    mutant.mutated = 1;
    mutant.change_reply = [delay](std::vector<std::uint8_t>&, ByteStep& step) { step.at += delay; };
  }};
  return conform_mutant<std::uint8_t>(parse_address("sim:hiperface?model=SKM36"), late, {.readings = 10}, 5ms);
}

std::string evidence_of(const Conformance& conformance, std::string_view id) {
  return std::ranges::find(conformance.clauses, id, &ClauseResult::id)->evidence;
}

// A host repeats the request, and the late reply to the first one arrives soon after the second.
TEST(Conformance, LateReplyIsNotCreditedToLaterRequest) {
  for (const Time delay : {70ms, 120ms, 300ms}) {
    const Conformance found = conform_delayed(delay);
    EXPECT_EQ(verdict_of(found, "answer-time"), Verdict::broken) << found.report();
    EXPECT_NE(evidence_of(found, "answer-time").find("good replies, the latest after "), std::string::npos)
        << found.report();
    EXPECT_EQ(verdict_of(found, "answer"), Verdict::untested) << found.report();
    EXPECT_NE(evidence_of(found, "answer").find(" 0 of them well, "), std::string::npos) << found.report();
    EXPECT_EQ(verdict_of(found, "check"), Verdict::untested) << found.report();
  }
  // These replies come later than the test listens: each of them arrives after another request than its own.
  for (const Time delay : {520ms, 560ms, 590ms, 1100ms}) {
    const Conformance found = conform_delayed(delay);
    EXPECT_NE(verdict_of(found, "answer-time"), Verdict::kept) << delay / 1ms << "\n" << found.report();
    EXPECT_NE(verdict_of(found, "answer"), Verdict::kept) << delay / 1ms << "\n" << found.report();
    EXPECT_NE(evidence_of(found, "answer").find(" 0 of them well"), std::string::npos) << found.report();
  }
}

// The connection may have added 150 ms to the time of each reply; a host waits 55 ms.
TEST(Conformance, TimeIsUntestedWithinUncertaintyOfPort) {
  const EncoderAddress address = parse_address("sim:hiperface?model=SKM36");
  const auto judge = [&](Time after, Time sent_late) {
    const Attempted one{
        .answered = true, .answered_after = after, .limit = 205ms, .latency = 150ms, .sent_late = sent_late};
    ClauseResult result{.verdict = Verdict::untested};
    judge_time(*address.unit, address.options, {.all = {one}, .requests = 1, .answered = 1, .good = 1}, result);
    return result;
  };
  EXPECT_EQ(judge(206ms, {}).verdict, Verdict::broken);
  EXPECT_EQ(judge(206ms, 60ms).verdict, Verdict::broken);
  for (const Time after : {56ms, 120ms, 205ms}) {
    const ClauseResult untested = judge(after, {});
    EXPECT_EQ(untested.verdict, Verdict::untested) << after / 1ms;
    EXPECT_NE(untested.evidence.find("the limit lies within this uncertainty"), std::string::npos) << untested.evidence;
  }
  EXPECT_EQ(judge(55ms, {}).verdict, Verdict::kept);
  // The request may have ended up to 60 ms before its end was reported.
  EXPECT_EQ(judge(1ms, 60ms).verdict, Verdict::untested);
  const ClauseResult negative = judge(-2687us, {});
  EXPECT_EQ(negative.verdict, Verdict::kept);
  EXPECT_EQ(negative.evidence.find("1 good replies, the latest after less than the port's uncertainty of 150000.0 us"),
            0U)
      << negative.evidence;
}

// A port that cannot change its rate, such as a TCP bridge or a pseudo-terminal.
class FixedRatePort final : public Port<std::uint8_t> {
 public:
  explicit FixedRatePort(Port<std::uint8_t>& port) : port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const ByteStep& step) override {
    if (step.kind == ByteStep::Kind::configure) {
      throw os::Failure(os::Failure::Kind::unsupported, "this port has one rate");
    }
    port_.begin(step);
  }
  ByteEvent wait(const ByteStep& step) override { return port_.wait(step); }

 private:
  Port<std::uint8_t>& port_;
};

TEST(Conformance, ClauseIsUntestedIfPortCannotChangeRate) {
  const EncoderAddress address = parse_address("sim:tformat");
  Link link;
  link.device = std::make_unique<VirtualDevice>(*address.unit, address.options, address.device);
  link.device->power_on(Time{});
  sim::SimPort<std::uint8_t> line(address.unit->link, address.line.with_some_rate(), *link.device->bytes());
  FixedRatePort port(line);
  link.bytes = &port;
  const Conformance found = conform(address, std::move(link), {.readings = 8});
  EXPECT_EQ(found.verdict(), Verdict::kept) << found.report();
  EXPECT_EQ(with_verdict(found, Verdict::untested), std::vector<std::string>{"bad-delimiter"});
  EXPECT_NE(found.report().find("this port has one rate"), std::string::npos);
}

TEST(Conformance, PrintsTapJunitAndReport) {
  const Conformance one{.protocol = "toy",
                        .clauses = {{"a", "doc", "1", "x < y", Verdict::kept, "seen"},
                                    {"b", "doc", "2", "z", Verdict::broken, "not \"seen\""},
                                    {"c", "doc", "3", "w", Verdict::untested, "nothing"}}};
  EXPECT_EQ(one.tap(),
            "TAP version 13\n1..3\nok 1 - a: x < y (1)\nnot ok 2 - b: z (2)\n# not \"seen\"\n"
            "ok 3 - c: w (3) # SKIP nothing\n");
  EXPECT_NE(one.junit().find("tests=\"3\" failures=\"1\" errors=\"0\" skipped=\"1\""), std::string::npos);
  EXPECT_NE(one.junit().find("x &lt; y"), std::string::npos);
  EXPECT_NE(one.junit().find("<failure message=\"not &quot;seen&quot;\"/>"), std::string::npos);
  EXPECT_NE(one.report().find("1 kept, 1 broken, 1 untested"), std::string::npos);
  EXPECT_EQ(one.verdict(), Verdict::broken);
}

// Programs that count tests may regard a run with only skipped tests as passed.
TEST(Conformance, TapBailsOutIfNoClauseWasJudged) {
  const Conformance nothing{.protocol = "toy", .clauses = {{"a", "doc", "1", "x", Verdict::untested, "nothing came"}}};
  EXPECT_EQ(nothing.verdict(), Verdict::untested);
  EXPECT_EQ(nothing.tap(),
            "TAP version 13\n1..1\nok 1 - a: x (1) # SKIP nothing came\n"
            "Bail out! nothing was seen that could be judged\n");
  EXPECT_NE(nothing.junit().find("tests=\"2\" failures=\"0\" errors=\"1\" skipped=\"1\""), std::string::npos);
  EXPECT_NE(nothing.junit().find("<error message=\"nothing was seen that could be judged\"/>"), std::string::npos);
  EXPECT_NE(nothing.report().find("0 kept, 0 broken, 1 untested\nnothing was seen that could be judged\n"),
            std::string::npos);
  Conformance some = nothing;
  some.clauses.push_back({"b", "doc", "2", "y", Verdict::kept, "seen"});
  EXPECT_EQ(some.verdict(), Verdict::kept);
  EXPECT_EQ(some.tap().find("Bail out!"), std::string::npos);
  some.left.emplace_back("absenc config set ...");
  EXPECT_EQ(some.verdict(), Verdict::broken);
  EXPECT_NE(some.tap().find("Bail out! the encoder is left changed\n"), std::string::npos);
  EXPECT_NE(some.junit().find("errors=\"1\""), std::string::npos);
  EXPECT_NE(
      some.junit().find("<error message=\"the encoder is left changed; to put it back: absenc config set ...\"/>"),
      std::string::npos);
}

// A report prints the name of the document before the paragraph, so the name must not contain the paragraph, too.
TEST(Clauses, DocumentNameContainsNoParagraph) {
  for (const Unit* unit : all_units()) {
    const auto look = [&](std::string_view id, std::string_view paragraph) {
      const std::string_view number = paragraph.substr(0, paragraph.find(' '));
      // skips paragraphs that have a name instead of a number
      if (number.find_first_not_of("0123456789.") != std::string_view::npos) return;
      EXPECT_EQ(unit->document.find(number), std::string_view::npos) << unit->id << " " << id << ": " << unit->document;
    };
    for (const Clause& clause : clauses_of(*unit)) look(clause.id, clause.paragraph);
    for (const HostClause& clause : host_clauses_of(*unit)) look(clause.id, clause.paragraph);
  }
}

}  // namespace
}  // namespace absenc::client
