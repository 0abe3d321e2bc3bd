// SPDX-License-Identifier: Apache-2.0
// Every clause holds for the virtual encoder, and is broken by a mutant that breaks it alone.
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/conform/asked_test.hpp"
#include "absenc/client/conform/conform_link.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/clause.hpp"
#include "absenc/sim/rough_line.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::client {
namespace {

using namespace std::chrono_literals;

/// Between device and line: changes what the device hears, and what it says for the third request.
template <class Item>
class Mutant final : public Machine<Item> {
 public:
  explicit Mutant(Machine<Item>& device) : device_(device) {}

  void feed(const Event<Item>& event) override {
    Event<Item> changed = event;
    if (event.kind == Event<Item>::Kind::selected) ++requests;
    if (event.kind == Event<Item>::Kind::received) {
      if (!driven) ++requests;
      heard_.assign(event.items.begin(), event.items.end());
      if (hear) hear(heard_);
      changed.items = heard_;
      if (heard_.empty()) return;
    }
    device_.feed(changed);
  }

  Step<Item> next(Time now) override {
    for (;;) {
      Step<Item> step = device_.next(now);
      if (step.kind != Step<Item>::Kind::transfer) return step;
      said.assign(step.out.begin(), step.out.end());
      if (!driven && heard_.empty()) ++requests;  // it sends by itself
      if (say && (requests == mutated || (always && requests > mutated))) {
        say(said, step);
        if (said.empty() && driven) continue;
        // A reply that is swallowed has left for the device.
        if (said.empty()) {
          device_.feed({.kind = Event<Item>::Kind::sent, .at = now});
          continue;
        }
      }
      step.out = said;
      return step;
    }
  }

  [[nodiscard]] std::span<const Item> heard() const { return heard_; }

  std::function<void(std::vector<Item>&)> hear{};
  std::function<void(std::vector<Item>&, Step<Item>&)> say{};
  std::vector<Item> said;
  bool driven = false;
  unsigned requests = 0;
  bool always = false;   // from then on
  unsigned mutated = 3;  // the first may be the one that finds the echo

 private:
  Machine<Item>& device_;
  std::vector<Item> heard_;
};

template <class Item>
using Change = std::function<void(Mutant<Item>&)>;

// One that sends by itself is read where it can be asked: a host that listens goes on to the next good frame.
EncoderAddress address_of_unit(const Unit& unit) {
  const std::string text = "sim:" + std::string(unit.id);
  const EncoderAddress usual = parse_address(text);
  const bool streams = unit.streams != nullptr && unit.streams(usual.options);
  return streams ? parse_address(text + "?mode=bus") : usual;
}

template <class Item>
Machine<Item>& machine_of(const VirtualDevice& device) {
  if constexpr (std::is_same_v<Item, CanFrame>) {
    return *device.frames();
  } else {
    return *device.bytes();
  }
}

template <class Item>
Conformance conform_mutant(const EncoderAddress& address, const Change<Item>& change) {
  Link link;
  link.device = std::make_unique<VirtualDevice>(*address.unit, address.options, address.device);
  link.device->power_on(Time{});
  Mutant<Item> mutant(machine_of<Item>(*link.device));
  const LinkKind kind = address.unit->link;
  mutant.driven = kind == LinkKind::clocked || kind == LinkKind::spi;
  if (change) change(mutant);
  sim::RoughLine<Item> line(kind, address.line.with_some_rate(), mutant, 1);
  if constexpr (std::is_same_v<Item, CanFrame>) {
    link.frames = &line;
  } else {
    link.bytes = &line;
  }
  return conform(address, std::move(link), {.readings = 8});
}

std::vector<std::string> broken(const Conformance& conformance) {
  std::vector<std::string> ids;
  for (const ClauseResult& one : conformance.clauses) {
    if (one.verdict != Verdict::kept) ids.emplace_back(one.id);
  }
  return ids;
}

/// What the encoder hears when it should hear nothing: the good request.
void hear_good(Mutant<std::uint8_t>& mutant, const Clause& clause) {
  auto good = std::make_shared<std::vector<std::uint8_t>>();
  mutant.hear = [good, clause](std::vector<std::uint8_t>& heard) {
    if (good->empty()) *good = heard;
    const bool unknown = clause.demand == Demand::unknown_silent || clause.demand == Demand::unknown_reported;
    const bool foreign = clause.demand == Demand::foreign_silent;
    if (unknown ? heard != std::vector<std::uint8_t>{clause.request} : (heard.front() != good->front()) != foreign) {
      return;
    }
    if (clause.demand == Demand::unknown_reported) {
      heard.clear();
    } else {
      heard = *good;
    }
  };
}

/// Bits of the reply: flipped alone, or two, or in every byte.
void flip(Mutant<std::uint8_t>& mutant, std::size_t first, std::size_t second) {
  mutant.say = [=](std::vector<std::uint8_t>& said, Step<std::uint8_t>&) {
    for (const std::size_t bit : {first, second}) {
      if (bit < said.size() * 8) said[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    }
  };
}

/// Flips a bit and makes the check at the end right again, as far as its last two bytes can.
void flip_and_repair(Mutant<std::uint8_t>& mutant, const EncoderAddress& address, std::size_t bit) {
  mutant.say = [&mutant, &address, bit](std::vector<std::uint8_t>& said, Step<std::uint8_t>&) {
    if (said.size() < 4 || bit >= (said.size() - 2) * 8) return;
    const std::vector<std::uint8_t> before = said;
    said[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    struct Nothing final : FieldSink {
      void put(const FieldValue&) override {}
    } nothing;
    for (unsigned check = 0; check < 0x10000; ++check) {
      said[said.size() - 2] = static_cast<std::uint8_t>(check);
      said[said.size() - 1] = static_cast<std::uint8_t>(check >> 8);
      const Error error = address.unit->decode(address.options, {.bytes = mutant.heard()}, {.bytes = said}, nothing);
      if (error != Error::bad_checksum) return;
    }
    said = before;
  };
}

std::vector<Change<std::uint8_t>> once_mutants_of(const Clause& clause) {
  using M = Mutant<std::uint8_t>;
  using List = std::vector<std::uint8_t>;
  switch (clause.demand) {
    case Demand::answered:
      return {[](M& m) { m.say = [](List& said, ByteStep&) { said.clear(); }; },
              [](M& m) { m.say = [](List& said, ByteStep&) { said.assign(said.size(), 0xFF); }; }};
    case Demand::in_time:
      return {[](M& m) { m.say = [](List&, ByteStep& step) { step.at += 15ms; }; },
              [](M& m) { m.say = [](List&, ByteStep& step) { step.at += 60ms; }; }};
    case Demand::whole:
      return {[](M& m) { m.say = [](List& said, ByteStep&) { said.pop_back(); }; },
              [](M& m) { m.say = [](List& said, ByteStep&) { said.push_back(0); }; }};
    case Demand::checked:
    case Demand::as_drawn: {
      std::vector<Change<std::uint8_t>> all;
      for (std::size_t bit = 0; bit < 160; ++bit) all.push_back([=](M& m) { flip(m, bit, bit + 1000); });
      for (std::size_t bit = 0; bit < 88; ++bit) {
        for (std::size_t other = bit + 1; other < 88; ++other) all.push_back([=](M& m) { flip(m, bit, other); });
      }
      all.push_back([](M& m) { m.say = [](List& said, ByteStep&) { said.assign(said.size(), 0); }; });
      all.push_back([](M& m) { m.say = [](List& said, ByteStep&) { said.assign(said.size(), 0xFF); }; });
      return all;
    }
    default:
      return {[clause](M& m) { hear_good(m, clause); }};
  }
}

/// Each of them once; from the third reply on, as a host may ask again by itself; from the eighth on, as some are spent
/// to find the echo where nothing is asked.
std::vector<Change<std::uint8_t>> mutants_of(const EncoderAddress& address, const Clause& clause) {
  std::vector<Change<std::uint8_t>> all = once_mutants_of(clause);
  const std::size_t count = all.size();
  if (clause.demand == Demand::as_drawn) {
    for (std::size_t bit = 160; bit-- > 0;) {
      all.push_back([=, &address](Mutant<std::uint8_t>& m) { flip_and_repair(m, address, bit); });
    }
  }
  for (const unsigned from : {3U, 8U}) {
    for (std::size_t i = 0; i < count; ++i) {
      all.push_back([change = all[i], from](Mutant<std::uint8_t>& m) {
        change(m);
        m.always = true;
        m.mutated = from;
      });
    }
  }
  return all;
}

std::vector<Change<CanFrame>> can_mutants_of(const EncoderAddress&, const Clause& clause) {
  using M = Mutant<CanFrame>;
  using List = std::vector<CanFrame>;
  if (clause.demand == Demand::foreign_silent) {
    return {[](M& m) {
      // Who was asked for, and a node that takes it for itself and answers in that name.
      const auto other = std::make_shared<std::uint32_t>(0);
      const auto own = std::make_shared<std::uint32_t>(0);
      m.hear = [=](List& heard) {
        const std::uint32_t node = heard.front().id & 0xFFU;
        if (*own == 0) *own = node;
        *other = node != *own ? node : 0;
        if (*other == 0) return;
        heard.front().id = (heard.front().id & ~0xFFU) | *own;
        heard.front().data[1] = static_cast<std::uint8_t>(*own);
      };
      m.mutated = 0;
      m.always = true;
      m.say = [=](List& said, Step<CanFrame>&) {
        if (*other != 0) said.front().id = (said.front().id & ~0xFFU) | *other;
      };
    }};
  }
  return {[](M& m) {
    m.say = [](List& said, Step<CanFrame>&) { said.clear(); };
    m.always = true;
  }};
}

template <class Item, class Make>
void check(const Unit& unit, const Make& make) {
  const EncoderAddress address = address_of_unit(unit);
  const Conformance good = conform_mutant<Item>(address, {});
  EXPECT_TRUE(all_kept(good)) << good.report();
  std::size_t tried = 0;
  std::size_t clauses = 0;
  for (const Clause& clause : clauses_of(unit)) {
    if (changes_encoder(clause.demand)) continue;
    ++clauses;
    bool found = false;
    std::string last;
    for (const Change<Item>& change : make(address, clause)) {
      ++tried;
      const Conformance mutant = conform_mutant<Item>(address, change);
      last = mutant.report();
      found = broken(mutant) == std::vector<std::string>{std::string(clause.id)};
      if (found) break;
    }
    EXPECT_TRUE(found) << unit.id << " " << clause.id << "\n" << last;
  }
  std::printf("%s: %zu clauses, %zu mutants\n", std::string(unit.id).c_str(), clauses, tried);
}

class Clauses : public ::testing::TestWithParam<const Unit*> {};

TEST_P(Clauses, EachIsBrokenByAMutantAlone) {
  const Unit& unit = *GetParam();
  if (clauses_of(unit).empty()) GTEST_SKIP() << "no clauses are known";
  if (unit.link == LinkKind::can) {
    check<CanFrame>(unit, can_mutants_of);
  } else {
    check<std::uint8_t>(unit, mutants_of);
  }
}

INSTANTIATE_TEST_SUITE_P(Units, Clauses, ::testing::ValuesIn(all_units().begin(), all_units().end()),
                         [](const auto& one) {
                           std::string name(one.param->id);
                           for (char& letter : name) letter = letter == '-' ? '_' : letter;
                           return name;
                         });

// The echo is neither a reply nor the time of one.
TEST(Conformance, HoldsBehindAnAdapterThatEchoes) {
  for (const char* const text : {"sim:tformat?echo=auto", "sim:tformat?echo=on", "sim:amt21?echo=auto"}) {
    const EncoderAddress address = parse_address(text);
    for (const bool silent : {false, true}) {
      Link link;
      link.device = std::make_unique<VirtualDevice>(*address.unit, address.options, address.device);
      link.device->power_on(Time{});
      Mutant<std::uint8_t> mutant(*link.device->bytes());
      mutant.mutated = 7;
      if (silent) mutant.say = [](std::vector<std::uint8_t>& said, ByteStep&) { said.clear(); };
      sim::SimPort<std::uint8_t> line(address.unit->link, address.line.with_some_rate(), mutant);
      line.set_echo(true);
      link.bytes = &line;
      const Conformance found = conform(address, std::move(link), {.readings = 8});
      EXPECT_EQ(all_kept(found), !silent) << text << "\n" << found.report();
      if (silent) {
        EXPECT_EQ(found.clauses.front().verdict, Verdict::broken) << found.report();
        EXPECT_EQ(found.clauses.front().id, "answer");
      }
    }
  }
}

TEST(Conformance, TellsProgramsAndPeople) {
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

// Programs that count tests take skipped ones for good.
TEST(Conformance, SaysWhenNothingCouldBeJudged) {
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
  some.left.emplace_back("absenc config set ...");
  EXPECT_EQ(some.verdict(), Verdict::broken);
}

// A report prints the paragraph behind the document.
TEST(Clauses, TheDocumentDoesNotNameTheParagraphAgain) {
  for (const Unit* unit : all_units()) {
    const auto look = [&](std::string_view id, std::string_view paragraph) {
      const std::string_view number = paragraph.substr(0, paragraph.find(' '));
      if (number.find_first_not_of("0123456789.") != std::string_view::npos) return;  // it has a name
      EXPECT_EQ(unit->document.find(number), std::string_view::npos) << unit->id << " " << id << ": " << unit->document;
    };
    for (const Clause& clause : clauses_of(*unit)) look(clause.id, clause.paragraph);
    for (const HostClause& clause : host_clauses_of(*unit)) look(clause.id, clause.paragraph);
  }
}

}  // namespace
}  // namespace absenc::client
