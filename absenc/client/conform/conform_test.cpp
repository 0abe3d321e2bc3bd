// SPDX-License-Identifier: Apache-2.0
// Checks that the virtual encoder satisfies every clause, and that at least two mutants break each clause, one of them
// no other clause.
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absenc/client/conform/evidence.hpp"
#include "absenc/client/conform/mutant_test.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

using namespace std::chrono_literals;

using ByteList = std::vector<std::uint8_t>;
using FrameList = std::vector<CanFrame>;
template <class Item>
using ReplyChanges = std::vector<ReplyChange<Item>>;

std::size_t bits_of(const ByteList& items) { return items.size() * 8; }
std::size_t bits_of(const FrameList& items) { return items.empty() ? 0 : 64; }
void flip_bit(ByteList& items, std::size_t bit) {
  if (bit < bits_of(items)) items[bit / 8] = static_cast<std::uint8_t>(items[bit / 8] ^ 1U << bit % 8);
}
void flip_bit(FrameList& items, std::size_t bit) {
  if (bit >= bits_of(items)) return;
  std::uint8_t& byte = items.front().data[bit / 8];
  byte = static_cast<std::uint8_t>(byte ^ 1U << bit % 8);
}

/// Lets the mutant flip a bit of its reply and search for the last two bytes with which the checksum is right again.
template <class Item>
void flip_and_repair(Mutant<Item>& mutant, const EncoderAddress& address, std::size_t bit) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    mutant.change_reply = [&mutant, &address, bit](ByteList& reply_items, ByteStep&) {
      if (reply_items.size() < 4 || bit >= (reply_items.size() - 2) * 8) return;
      const ByteList before = reply_items;
      flip_bit(reply_items, bit);
      for (unsigned check = 0; check < 0x10000; ++check) {
        reply_items[reply_items.size() - 1] = static_cast<std::uint8_t>(check);
        reply_items[reply_items.size() - 2] = static_cast<std::uint8_t>(before[reply_items.size() - 2] + (check >> 8));
        const Error error =
            address.unit->check(address.options, {.bytes = mutant.last_request()}, {.bytes = reply_items});
        if (error != Error::bad_checksum) return;
      }
      reply_items = before;
    };
  }
}

/// Adds mutants that change the reply to a single request, to all requests from the third on (a host may repeat its
/// request), and to all from the eighth on (some hosts use the first requests to detect the echo).
template <class Item>
void add_reply_mutants(ReplyChanges<Item>& all, const std::function<void(Mutant<Item>&)>& change) {
  all.push_back({.change = change});
  for (const unsigned from : {3U, 8U}) {
    all.push_back({.change = [change, from](Mutant<Item>& m) {
      change(m);
      m.always = true;
      m.mutated = from;
    }});
  }
}
template <class Item>
void add_reply_mutants(ReplyChanges<Item>& all, void (*change_reply)(std::vector<Item>&, Step<Item>&)) {
  add_reply_mutants<Item>(all, [change_reply](Mutant<Item>& m) { m.change_reply = change_reply; });
}

/// Adds mutants that send their first reply again: the whole reply, or its first bits with the rest of a later reply.
template <class Item>
void add_stale_mutants(ReplyChanges<Item>& all, const Clause& clause) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    const auto add = [&](std::size_t kept_bits) {
      add_reply_mutants<Item>(all, [kept_bits](Mutant<Item>& m) {
        const auto first = std::make_shared<ByteList>();
        m.mutated = 1;
        m.always = true;
        m.change_reply = [first, kept_bits](ByteList& reply_items, ByteStep&) {
          if (first->empty()) *first = reply_items;
          for (std::size_t bit = 0; bit < std::min(kept_bits, bits_of(reply_items)); ++bit) {
            const auto mask = static_cast<std::uint8_t>(0x80U >> bit % 8);
            reply_items[bit / 8] =
                static_cast<std::uint8_t>((reply_items[bit / 8] & ~mask) | ((*first)[bit / 8] & mask));
          }
        };
      });
    };
    if ((clause.errors & any_of(Error::sequence_mismatch)) != 0) add(SIZE_MAX);
    for (std::size_t bits = 1; bits < 160 && (clause.errors & any_of(Error::cross_check_failed)) != 0; ++bits)
      add(bits);
  }
}

template <class Item>
ReplyChanges<Item> frame_mutants(const EncoderAddress& address, const Clause& clause) {
  using List = std::vector<Item>;
  ReplyChanges<Item> all;
  add_stale_mutants(all, clause);
  if constexpr (std::is_same_v<Item, CanFrame>) {
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.front().extended = true; });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.front().size = 7; });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.front().size = 2; });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) {
      reply_items.front().extended = true;
      reply_items.front().id |= 0x1000'0000;
    });
  } else {
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.pop_back(); });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.push_back(0); });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.assign(reply_items.size(), 0); });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.assign(reply_items.size(), 0xFF); });
  }
  if (clause.demand == Demand::whole) return all;
  for (std::size_t bit = 0; bit < 160; ++bit) {
    add_reply_mutants<Item>(all, [=](Mutant<Item>& m) {
      m.change_reply = [bit](List& reply_items, Step<Item>&) { flip_bit(reply_items, bit); };
    });
  }
  if (clause.demand == Demand::as_drawn) {
    for (std::size_t bit = 160; bit-- > 0;) {
      all.push_back({.change = [=, &address](Mutant<Item>& m) { flip_and_repair(m, address, bit); }});
    }
  }
  for (std::size_t bit = 0; bit < 88; ++bit) {
    for (std::size_t other = bit + 1; other < 88; ++other) {
      add_reply_mutants<Item>(all, [=](Mutant<Item>& m) {
        m.change_reply = [=](List& reply_items, Step<Item>&) {
          flip_bit(reply_items, bit);
          flip_bit(reply_items, other);
        };
      });
    }
  }
  return all;
}

/// Returns mutants with each condition of the encoder at both ends of its range, and mutants whose line always flips
/// the same bit.
template <class Item>
ReplyChanges<Item> command_mutants(const EncoderAddress& address) {
  ReplyChanges<Item> all;
  for (const Condition& one : address.unit->conditions) {
    for (const std::int64_t value : {one.maximum, one.minimum, one.normal + 5}) {
      if (value == one.normal || value < one.minimum || value > one.maximum) continue;
      all.push_back({.condition = fmt::format("{}={}", one.name, value)});
    }
  }
  for (std::size_t bit = 0; bit < 96; ++bit) {
    all.push_back({.change = [=](Mutant<Item>& m) {
      m.always = true;
      m.mutated = 1;
      m.change_reply = [bit](std::vector<Item>& reply_items, Step<Item>&) { flip_bit(reply_items, bit); };
    }});
    all.push_back({.change = [=](Mutant<Item>& m) {
      m.change_request = [bit](std::vector<Item>& last_request) { flip_bit(last_request, bit); };
    }});
  }
  return all;
}

/// Returns mutants that treat every request except the first kind wrongly: they send the reply to the first request, no
/// reply, or another reply.
template <class Item>
ReplyChanges<Item> special_request_mutants(const Clause& clause) {
  using M = Mutant<Item>;
  using List = std::vector<Item>;
  ReplyChanges<Item> all;
  const auto hears_good = [](M& m) {
    m.change_request = [&m](List& last_request) {
      if (m.is_special) last_request = m.good;
    };
    m.on_damage = true;
  };
  all.push_back({.change = hears_good});
  all.push_back({.change = [](M& m) {
    m.change_request = [&m](List& last_request) {
      if (m.is_special) last_request.clear();
    };
  }});
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    // A mutant whose reply has the right length but wrong content.
    all.push_back({.change = [hears_good](M& m) {
      hears_good(m);
      m.changes_special = true;
      m.change_reply = [](List& reply_items, Step<Item>&) {
        for (std::size_t i = 0; i < reply_items.size(); ++i) reply_items[i] = static_cast<std::uint8_t>(0x30 + i);
      };
    }});
    if (clause.reaction == Reaction::silent) return all;
    for (std::size_t bit = 0; bit < 88; ++bit) {
      for (std::size_t other = bit + 8; other < 88; other += 8) {
        all.push_back({.change = [=](M& m) {
          m.changes_special = true;
          m.change_reply = [=](List& reply_items, Step<Item>&) {
            flip_bit(reply_items, bit);
            flip_bit(reply_items, other);
          };
        }});
      }
    }
  } else {
    // A mutant whose reply carries the node number of the request.
    all.push_back({.change = [hears_good](M& m) {
      const auto requested = std::make_shared<std::uint32_t>(0);
      m.change_request = [&m, requested](List& last_request) {
        *requested = last_request.front().id;
        if (m.is_special) last_request = m.good;
      };
      m.changes_special = true;
      m.change_reply = [requested](List& reply_items, Step<Item>&) {
        reply_items.front().id = (reply_items.front().id & ~0xFFU) | (*requested & 0xFF);
      };
    }});
    all.push_back({.change = [hears_good](M& m) {
      const auto requested = std::make_shared<std::uint32_t>(0);
      m.change_request = [&m, requested](List& last_request) {
        *requested = last_request.front().id;
        if (m.is_special) last_request = m.good;
      };
      m.changes_special = true;
      m.change_reply = [requested](List& reply_items, Step<Item>&) {
        reply_items.front() = {.id = 0x100 | (*requested & 0xFF), .size = 8, .data = {0x11}};
      };
    }});
  }
  return all;
}

template <class Item>
ReplyChanges<Item> mutants_of(const EncoderAddress& address, const Clause& clause) {
  using List = std::vector<Item>;
  ReplyChanges<Item> all;
  switch (clause.demand) {
    case Demand::answered:
    case Demand::streamed:
      add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.clear(); });
      if constexpr (std::is_same_v<Item, std::uint8_t>) {
        add_reply_mutants<Item>(all,
                                [](List& reply_items, Step<Item>&) { reply_items.assign(reply_items.size(), 0xFF); });
      } else {
        add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { ++reply_items.front().id; });
      }
      return all;
    case Demand::in_time:
      add_reply_mutants<Item>(all, [](List&, Step<Item>& step) { step.at += 15ms; });
      add_reply_mutants<Item>(all, [](List&, Step<Item>& step) { step.at += 60ms; });
      return all;
    case Demand::whole:
    case Demand::checked:
    case Demand::as_drawn:
      return frame_mutants<Item>(address, clause);
    case Demand::does:
      return command_mutants<Item>(address);
    default:
      break;
  }
  // Sends valid requests that are addressed to other encoders.
  if (clause.demand == Demand::foreign_silent) {
    for (const ReplyChange<Item>& change : special_request_mutants<Item>(clause)) {
      all.push_back({.change = [change = change.change, &address](Mutant<Item>& m) {
        change(m);
        m.is_meant = [&address, &m](const List& request) {
          if constexpr (std::is_same_v<Item, CanFrame>) {
            return true;
          } else {
            const auto asks = [&](const List& requested) {
              return encoder_of(*address.unit, address.options, {.bytes = requested});
            };
            const bool is_request = address.unit->check(address.options, {.bytes = request}, {}) == Error::none;
            return is_request && (!asks(request) || asks(request) != asks(m.good));
          }
        };
      }});
    }
    return all;
  }
  constexpr int most_specials = 8;
  for (const ReplyChange<Item>& change : special_request_mutants<Item>(clause)) {
    for (int special = 0; special < most_specials; ++special) {
      all.push_back({.change = [change = change.change, special](Mutant<Item>& m) {
        change(m);
        m.special = special;
      }});
    }
  }
  return all;
}

// Returns whether the mutant breaks only this clause. Clauses about commands may break together: the registers depend
// on channel 2, and both depend on the identity.
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
    EXPECT_GE(alone, 1U) << unit.id << " " << clause.id << "\n" << last;
    EXPECT_GE(broken, 2U) << unit.id << " " << clause.id << "\n" << last;
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

// Checks that a mutant can break each clause whose verdict is `kept`: a clause that does not apply with these options
// must not be `kept`.
template <class Item>
void check_kept(const EncoderAddress& address, std::set<std::string>& seen) {
  const Unit& unit = *address.unit;
  try {
    const Conformance good = conform_mutant<Item>(address, {}, {.readings = 3});
    // A report that equals an earlier one, including the number of detectable changes, needs no second check.
    if (!seen.insert(good.report()).second) return;
    for (const Clause& clause : clauses_of(unit)) {
      if (verdict_of(good, clause.id) != Verdict::kept) continue;
      bool broken = false;
      for (const ReplyChange<Item>& change : mutants_of<Item>(address, clause)) {
        broken = verdict_of(conform_mutant<Item>(address, change, {.readings = 3}), clause.id) == Verdict::broken;
        if (broken) break;
      }
      EXPECT_TRUE(broken) << variation_name(address) << ": " << clause.id << "\n" << good.report();
    }
  } catch (const UsageError&) {  // no host reads with these options
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

// The echo must not be taken for a reply, and its time not for the response time.
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

// Without "Bail out!", programs that count tests would regard a run with only skipped tests as passed.
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
  some.left.emplace_back("absenc config set ...");
  EXPECT_EQ(some.verdict(), Verdict::broken);
}

// The text for people must name the paragraph after the document.
TEST(Clauses, DocumentNameContainsNoParagraph) {
  for (const Unit* unit : all_units()) {
    const auto look = [&](std::string_view id, std::string_view paragraph) {
      const std::string_view number = paragraph.substr(0, paragraph.find(' '));
      // this paragraph of the document has a name instead of a number
      if (number.find_first_not_of("0123456789.") != std::string_view::npos) return;
      EXPECT_EQ(unit->document.find(number), std::string_view::npos) << unit->id << " " << id << ": " << unit->document;
    };
    for (const Clause& clause : clauses_of(*unit)) look(clause.id, clause.paragraph);
    for (const HostClause& clause : host_clauses_of(*unit)) look(clause.id, clause.paragraph);
  }
}

}  // namespace
}  // namespace absenc::client
