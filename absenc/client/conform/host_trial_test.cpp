// SPDX-License-Identifier: Apache-2.0
// Checks the clauses for hosts: our own host keeps them, hosts with a flaw break them, and random senders keep none.
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "absenc/client/conform/asked_test.hpp"
#include "absenc/client/conform/strangers_test.hpp"
#include "absenc/client/conform/trial_host_test.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::client {
namespace {

Flaws host_that_sends(HostScript script) { return {.sends = {script.begin(), script.end()}}; }

/// Returns defects of SPI controllers in clock, length, mode, or the time before a transfer.
std::vector<Flaws> flaws_of_controllers() {
  using std::chrono::microseconds;
  using std::chrono::milliseconds;
  std::vector<Flaws> all{{.other_mode = true}, {.without_lead = true}};
  for (const std::uint32_t rate : {200'000u, 500'000u}) all.push_back({.rate = rate, .other_mode = true});
  all.push_back({.bytes = 1, .without_lead = true});
  for (const Time too_early_by : {Time(microseconds(100)), Time(milliseconds(1))})
    all.push_back({.too_early_by = too_early_by});
  for (const int bytes : {-1, -2, -3, -4}) all.push_back({.bytes = bytes});
  for (const std::uint32_t rate : {5'000u, 20'000u, 300'000u, 500'000u, 5'000'000u, 6'000'000u}) {
    all.push_back({.rate = rate});
  }
  for (const std::uint32_t rate : {12'500'000u, 20'000'000u}) all.push_back({.rate = rate, .bytes = 40});
  return all;
}

std::vector<Flaws> flaws_for(const EncoderAddress& address) {
  const Unit& unit = *address.unit;
  std::vector<Flaws> all;
  for (const unsigned asked : {1u, 2u}) {
    all.push_back({.stops_at_silence = asked});
    all.push_back({.stops_at_damage = asked});
    all.push_back({.stops_at_refusal = asked});
  }
  for (const Time skipped_wait : {Time(100'000), Time(1'000'000), Time(19'000'000), Time(100'000'000)}) {
    all.push_back({.skipped_wait = skipped_wait});
  }
  if (host_clocks(unit.link)) {
    const std::vector<Flaws> controllers = flaws_of_controllers();
    all.insert(all.end(), controllers.begin(), controllers.end());
  }
  for (const HostClause& clause : host_clauses_of(unit)) {
    for (const HostScript script : clause.breaks) {
      if (!script.empty()) all.push_back(host_that_sends(script));
    }
  }
  const Time character = address.line.with_some_rate().character();
  for (const Command& first : unit.commands) {
    for (const Command& then : unit.commands) {
      const auto add = [&](Time distance) {
        all.push_back({.sends = {{.what = first.name}, {.pause = distance, .what = then.name, .times = 10}}});
      };
      for (int halves = 0; halves <= 60; halves += 4) add(character * halves / 2);
      for (const int us : {45, 100, 150}) add(std::chrono::microseconds(us));
    }
  }
  return all;
}

/// Returns flaws of a host that also sends permitted requests which our own host never sends.
Flaws host_with_permitted_extras(const Unit& unit) {
  Flaws flaws;
  for (const HostClause& clause : host_clauses_of(unit)) {
    flaws.sends.insert(flaws.sends.end(), clause.keeps.begin(), clause.keeps.end());
  }
  return flaws;
}

Conformance judged(const EncoderAddress& address, const Flaws& flaws, bool all = false) {
  if (address.unit->link == LinkKind::can) return Host<CanFrame>(address, flaws).judged(all);
  return Host<std::uint8_t>(address, flaws).judged(all);
}

std::vector<std::string> with_verdict(const Conformance& conformance, Verdict verdict) {
  std::vector<std::string> ids;
  for (const ClauseResult& one : conformance.clauses) {
    if (one.verdict == verdict) ids.emplace_back(one.id);
  }
  return ids;
}

EncoderAddress address_of_unit(const Unit& unit, std::string_view motion) {
  std::string text = fmt::format("sim:{}?motion={}", unit.id, motion);
  for (const HostClause& clause : host_clauses_of(unit)) {
    if (!clause.options.empty()) text += fmt::format("&{}", clause.options);
  }
  return polled_address(text);
}

bool is_mistake_of(std::span<const std::string> broken, std::string_view clause) {
  // A host that sends other bytes may also violate the clause "asks" (which requests a host may send).
  return std::find(broken.begin(), broken.end(), clause) != broken.end() &&
         std::all_of(broken.begin(), broken.end(), [&](const std::string& id) { return id == clause || id == "asks"; });
}

/// Returns the unit's request for a position.
template <class Item>
std::vector<Item> request_of(const EncoderAddress& address) {
  const Unit& unit = *address.unit;
  std::vector<std::uint8_t> bytes(64);
  const auto size = unit.encode(address.options, *find_command(unit, Verb::read), {}, bytes);
  bytes.resize(size ? *size : 0);
  if constexpr (std::is_same_v<Item, CanFrame>) {
    return {*parse_wire_text(unit.link, "request", {reinterpret_cast<char*>(bytes.data()), bytes.size()}).can};
  } else {
    return bytes;
  }
}

std::size_t bits_of(const std::vector<std::uint8_t>& request) { return request.size() * 8; }
std::size_t bits_of(const std::vector<CanFrame>& request) { return request.empty() ? 0 : request[0].size * 8u; }
void flip(std::vector<std::uint8_t>& request, std::size_t bit) {
  request[bit / 8] = static_cast<std::uint8_t>(request[bit / 8] ^ 1u << bit % 8);
}
void flip(std::vector<CanFrame>& request, std::size_t bit) {
  request[0].data[bit / 8] = static_cast<std::uint8_t>(request[0].data[bit / 8] ^ 1u << bit % 8);
}

Error error_of(const EncoderAddress& address, const std::vector<std::uint8_t>& request) {
  return address.unit->check(address.options, {.bytes = request}, {});
}
Error error_of(const EncoderAddress& address, const std::vector<CanFrame>& request) {
  return address.unit->check(address.options, {.can = request.data()}, {});
}

/// Returns requests for a position with one wrong bit that makes them invalid.
template <class Item>
std::vector<std::vector<Item>> damaged_requests(const EncoderAddress& address) {
  std::vector<std::vector<Item>> all;
  const std::vector<Item> good = request_of<Item>(address);
  for (std::size_t bit = 0; bit < bits_of(good); ++bit) {
    std::vector<Item> one = good;
    flip(one, bit);
    const Error error = error_of(address, one);
    const bool of_others = std::is_same_v<Item, CanFrame> && error == Error::unexpected_reply;
    if (error != Error::none && !of_others) all.push_back(one);
  }
  return all;
}

/// Returns verdicts on hosts that send a damaged request, always or in turn with a good one.
template <class Item>
std::vector<Conformance> judged_with_damaged_requests(const EncoderAddress& address) {
  std::vector<Conformance> all;
  const std::vector<Item> good = request_of<Item>(address);
  const std::vector<std::vector<Item>> damaged = damaged_requests<Item>(address);
  for (auto one = damaged.rbegin(); one != damaged.rend(); ++one) {
    std::size_t sent = 0;
    all.push_back(Host<Item>(address, {}).judged_sending([&] { return *one; }));
    all.push_back(Host<Item>(address, {}).judged_sending([&] { return sent++ % 2 == 0 ? good : *one; }));
    if (all.size() >= 8) break;
  }
  return all;
}

class HostClauses : public ::testing::TestWithParam<const Unit*> {};

TEST_P(HostClauses, EachClauseIsBrokenByTwoMutantsAlone) {
  const Unit& unit = *GetParam();
  std::size_t tried = 0;
  std::map<std::string_view, unsigned> found;
  // for each clause: all clauses that were broken by the last host that broke this one
  std::map<std::string_view, std::string> with_others;
  const auto left = [&] {
    return std::ranges::any_of(host_clauses_of(unit), [&](const HostClause& one) { return found[one.id] < 2; });
  };
  for (const char* const motion : {"rpm=60", "still"}) {
    const EncoderAddress address = address_of_unit(unit, motion);
    const Conformance own = judged(address, host_with_permitted_extras(unit), true);
    EXPECT_EQ(own.verdict(), Verdict::kept) << own.report();
    if (std::string_view(motion) == "still") {
      EXPECT_EQ(with_verdict(own, Verdict::untested), std::vector<std::string>{}) << own.report();
    }
    const auto count = [&](const Conformance& one) {
      ++tried;
      const std::vector<std::string> broken = with_verdict(one, Verdict::broken);
      for (const HostClause& clause : host_clauses_of(unit)) {
        if (is_mistake_of(broken, clause.id)) ++found[clause.id];
        if (std::ranges::count(broken, clause.id) != 0)
          with_others[clause.id] = fmt::format("{}", fmt::join(broken, ", "));
      }
    };
    if (unit.link == LinkKind::can) {
      for (const Conformance& one : judged_with_damaged_requests<CanFrame>(address)) count(one);
    } else {
      for (const Conformance& one : judged_with_damaged_requests<std::uint8_t>(address)) count(one);
    }
    for (const Flaws& flaws : flaws_for(address)) {
      if (!left()) break;
      count(judged(address, flaws));
    }
  }
  for (const HostClause& clause : host_clauses_of(unit)) {
    EXPECT_GE(found[clause.id], 2U) << fmt::format(
        "{}: {} of {} tried hosts break the clause \"{}\" alone, and two must; the last host that broke it broke: {}.\n"
        "Add hosts to `breaks` of the clause. If each of them breaks another clause too, both demands have one cause: "
        "make one clause of them.",
        unit.id, found[clause.id], tried, clause.id,
        with_others.contains(clause.id) ? with_others[clause.id] : "none does");
  }
  std::printf("%s: %zu clauses of a host, %zu mutants\n", std::string(unit.id).c_str(), host_clauses_of(unit).size(),
              tried);
}

TEST_P(HostClauses, ScriptBreaksItsClause) {
  const EncoderAddress address = address_of_unit(*GetParam(), "still");
  for (const HostClause& clause : host_clauses_of(*GetParam())) {
    for (const HostScript script : clause.breaks) {
      if (script.empty()) continue;
      const Conformance found = judged(address, host_that_sends(script));
      const std::vector<std::string> broken = with_verdict(found, Verdict::broken);
      EXPECT_TRUE(is_mistake_of(broken, clause.id)) << fmt::format(
          "{}: the script that begins with \"{}\" must break \"{}\", and besides it only \"asks\"; it breaks: {}\n{}",
          GetParam()->id, script.front().what, clause.id, fmt::join(broken, ", "), found.report());
    }
  }
}

// If the host did nothing to which a rule applies, the rule must be untested, not kept.
TEST_P(HostClauses, UnobservedRuleIsUntested) {
  const EncoderAddress address = address_of_unit(*GetParam(), "still");
  const Conformance silent = judged(address, {.is_silent = true});
  EXPECT_EQ(silent.verdict(), Verdict::untested) << silent.report();
  const Conformance read = judged(address, {});
  EXPECT_EQ(read.verdict(), Verdict::kept) << read.report();
  for (const ClauseResult& one : read.clauses) {
    const HostClause& clause = *std::ranges::find(host_clauses_of(*GetParam()), one.id, &HostClause::id);
    // The host of this test only reads positions and memory. Clauses about other requests need a host with a script, so
    // they are left out.
    if (!clause.breaks[0].empty() && clause.options.empty() && one.verdict == Verdict::kept) {
      EXPECT_NE(one.evidence.find("looked at "), std::string::npos) << one.evidence;
      EXPECT_EQ(one.evidence.find("looked at 0"), std::string::npos) << one.evidence;
    }
  }
}

// ---- Senders that are no host of the protocol

void expect_none_kept(const Conformance& found, std::string_view who) {
  EXPECT_EQ(with_verdict(found, Verdict::kept), std::vector<std::string>{}) << who << "\n" << found.report();
}

template <class Item>
void check_stranger_hosts(const EncoderAddress& address) {
  const auto judged_sending = [&](const auto& next) { return Host<Item>(address, {}).judged_sending(next); };
  sim::Random random(1);
  for (int i = 0; i < 3; ++i) {
    expect_none_kept(judged_sending([&] { return noise<Item>(random, 5); }), "random");
  }
  const std::vector<Item> good = request_of<Item>(address);
  const std::vector<std::vector<Item>> damaged = damaged_requests<Item>(address);
  ASSERT_FALSE(damaged.empty());
  std::size_t sent = 0;
  expect_none_kept(judged_sending([&] { return damaged[sent++ % damaged.size()]; }), "damaged");
  for (const std::vector<Item>& one : damaged) {
    const Conformance found = judged_sending([&] { return one; });
    expect_none_kept(found, "always the same damaged one");
    EXPECT_EQ(found.verdict(), Verdict::broken) << found.report();
    expect_none_kept(judged_sending([&] { return sent++ % 2 == 0 ? good : one; }), "every second one damaged");
  }
  for (const Unit* const other : all_units()) {
    if (carries_bits(other->link) || (other->link == LinkKind::can) != std::is_same_v<Item, CanFrame>) continue;
    const std::vector<Item> request = request_of<Item>(polled_address(fmt::format("sim:{}", other->id)));
    // Skips units without a request in bytes or frames, and units whose request is also a valid request of the tested
    // unit.
    if (request.empty() || error_of(address, request) == Error::none) continue;
    expect_none_kept(judged_sending([&] { return request; }), other->id);
  }
}

TEST_P(HostClauses, StrangerKeepsNoClause) {
  const EncoderAddress address = address_of_unit(*GetParam(), "still");
  switch (GetParam()->link) {
    case LinkKind::clocked:
      GTEST_SKIP() << "its requests have no bytes";
    case LinkKind::can:
      return check_stranger_hosts<CanFrame>(address);
    default:
      return check_stranger_hosts<std::uint8_t>(address);
  }
}

TEST_P(HostClauses, TwoRequestsInOneWriteBreakAClause) {
  const Unit& unit = *GetParam();
  if (unit.link != LinkKind::half_duplex) GTEST_SKIP() << "its host need not wait";
  const EncoderAddress address = address_of_unit(unit, "still");
  std::vector<std::uint8_t> two = request_of<std::uint8_t>(address);
  two.insert(two.end(), two.begin(), two.end());
  const Conformance found = Host<std::uint8_t>(address, {}).judged_sending([&] { return two; });
  EXPECT_EQ(found.verdict(), Verdict::broken) << found.report();
}

INSTANTIATE_TEST_SUITE_P(Units, HostClauses, ::testing::ValuesIn([] {
                           std::vector<const Unit*> units;
                           for (const Unit* unit : all_units()) {
                             if (!host_clauses_of(*unit).empty()) units.push_back(unit);
                           }
                           return units;
                         }()),
                         [](const auto& one) {
                           std::string name(one.param->id);
                           for (char& letter : name) letter = letter == '-' ? '_' : letter;
                           return name;
                         });

}  // namespace
}  // namespace absenc::client
