// SPDX-License-Identifier: Apache-2.0
// The clauses that change an encoder: each is broken by a mutant that breaks it alone, and whatever ends them at
// whatever step leaves the memory of the virtual encoder as it was.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absenc/client/conform/asked_test.hpp"
#include "absenc/client/conform/conform_link.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/row.hpp"
#include "absenc/host/session.hpp"
#include "absenc/os/error.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/clause.hpp"
#include "absenc/sim/rough_line.hpp"
#include "tests/cases.hpp"

namespace absenc::client {
namespace {

using Bytes8 = std::vector<std::uint8_t>;

/// An encoder that obeys, but not all of it.
class Disobedient final : public Machine<std::uint8_t> {
 public:
  explicit Disobedient(const VirtualDevice& device) : line_(*device.bytes()), device_(*device.device().bytes) {}

  void feed(const Event<std::uint8_t>& event) override {
    // What a clock asks for has no bytes.
    if (event.kind == Event<std::uint8_t>::Kind::received || event.kind == Event<std::uint8_t>::Kind::selected) {
      ++requests_;
      const bool deaf = requests_ >= deaf_from && requests_ < deaf_until;
      if (deaf ||
          (!deaf_to.empty() && std::equal(event.items.begin(), event.items.end(), deaf_to.begin(), deaf_to.end())))
        return;
    }
    const Bytes8 before(device_.memory().begin(), device_.memory().end());
    line_.feed(event);
    look(before);
  }
  Step<std::uint8_t> next(Time now) override {
    const Bytes8 before(device_.memory().begin(), device_.memory().end());
    const Step<std::uint8_t> step = line_.next(now);
    look(before);
    return step;
  }

  Bytes8 deaf_to{};                                          // a request that it does not hear
  unsigned deaf_from = 0;                                    // the number of a request that it does not hear, from 1
  unsigned deaf_until = 0;                                   // and of the next that it does
  unsigned change = 0;                                       // which change of its memory, from 1
  std::function<void(MutableBytes, const Bytes8&)> spoil{};  // what was the memory before

 private:
  void look(const Bytes8& before) {
    if (std::equal(before.begin(), before.end(), device_.memory().begin()) || ++changes_ != change) return;
    spoil(device_.memory(), before);
  }

  Machine<std::uint8_t>& line_;
  Device<std::uint8_t>& device_;
  unsigned changes_ = 0;
  unsigned requests_ = 0;
};

/// Somebody asks to end, or the line is lost, at the step of this number.
class EndingPort final : public Port<std::uint8_t> {
 public:
  explicit EndingPort(Port<std::uint8_t>& port) : port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const Step<std::uint8_t>& step) override { port_.begin(step); }
  Event<std::uint8_t> wait(const Step<std::uint8_t>& step) override {
    if (++steps == at && end) end();
    if (lost && steps >= at) throw os::Failure(os::Failure::Kind::lost, "the line is lost");
    return port_.wait(step);
  }

  unsigned steps = 0;
  unsigned at = 0;
  bool lost = false;
  std::function<void()> end{};

 private:
  Port<std::uint8_t>& port_;
};

struct Bench {
  explicit Bench(const EncoderAddress& where) : address(where) {
    link.device = std::make_unique<VirtualDevice>(*address.unit, address.options, address.device);
    link.device->power_on(Time{});
    device = link.device->device().bytes;
    mutant = std::make_unique<Disobedient>(*link.device);
    line =
        std::make_unique<sim::RoughLine<std::uint8_t>>(address.unit->link, address.line.with_some_rate(), *mutant, 1);
    port = std::make_unique<EndingPort>(*line);
    link.bytes = port.get();
  }
  /// Without what counts how often it was written.
  [[nodiscard]] Bytes8 memory() const {
    constexpr std::ptrdiff_t settings = 7;  // of an RAA38S6
    const bool counts = address.unit->id == "raa38-modbus";
    return {device->memory().begin(), counts ? device->memory().begin() + settings : device->memory().end()};
  }
  /// What the clauses set, as the encoder tells when it is asked.
  [[nodiscard]] std::string settings() const {
    const Step<std::uint8_t> rest{.at = line->now() + std::chrono::milliseconds(50)};
    while (line->now() < rest.at && line->wait(rest).kind != Event<std::uint8_t>::Kind::timer) {
    }
    std::string text;
    for (const Clause& clause : clauses_of(*address.unit)) {
      if (clause.setting.empty()) continue;
      std::vector<std::byte> storage(address.unit->host_storage);
      host::Session<std::uint8_t> session(*address.unit, address.options, *line, storage);
      const Conversation<std::uint8_t>* ended = session.run(*find_command(*address.unit, clause.setting));
      AnswerSink sink;
      ended->report(sink);
      text += fmt::format("{} {}\n", clause.setting, to_text(sink.answer[clause.field]));
    }
    return text;
  }
  // The device stays, to be looked at.
  [[nodiscard]] Conformance run(const std::function<bool()>& over = {}) const {
    Link way;
    way.bytes = link.bytes;
    return conform(address, std::move(way), {.readings = 3, .changes = true, .over = over}, "NAME");
  }

  EncoderAddress address;
  Link link;
  Device<std::uint8_t>* device = nullptr;
  std::unique_ptr<Disobedient> mutant;
  std::unique_ptr<sim::RoughLine<std::uint8_t>> line;
  std::unique_ptr<EndingPort> port;
};

std::vector<const Clause*> changing(const Unit& unit) {
  std::vector<const Clause*> clauses;
  for (const Clause& clause : clauses_of(unit)) {
    if (changes_encoder(clause.demand)) clauses.push_back(&clause);
  }
  return clauses;
}

class ChangingClauses : public ::testing::TestWithParam<const Unit*> {
 protected:
  // Of its position only a command can make 0.
  EncoderAddress address() const { return parse_address(fmt::format("sim:{}?singleturn=1000", GetParam()->id)); }
};

using Spoil = std::function<void(Disobedient&)>;

std::vector<Spoil> spoils_of(const EncoderAddress& address, const Clause& clause, std::size_t memory) {
  std::vector<Spoil> all;
  const bool restarts = clause.demand == Demand::restarts;
  const Command* command =
      restarts ? find_command(*address.unit, clause.command) : find_command(*address.unit, clause.verb);
  if ((clause.demand == Demand::reset || restarts) && command != nullptr) {
    Bytes8 request(64);
    const auto size = address.unit->encode(address.options, *command, {}, request);
    if (size)
      all.push_back([request = Bytes8(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(*size))](
                        Disobedient& one) { one.deaf_to = request; });
    return all;
  }
  // What is set may be in no memory.
  const unsigned step = address.unit->link == LinkKind::clocked ? 20 : 5;
  for (unsigned from = 1; clause.demand >= Demand::set && from < 300 * step; from += step) {
    all.push_back([=](Disobedient& one) {
      one.deaf_from = from;
      one.deaf_until = from + 30;  // longer than anybody repeats
    });
  }
  for (unsigned change = 1; change <= 8 && clause.demand < Demand::set; ++change) {
    all.push_back([=](Disobedient& one) {
      one.change = change;
      one.spoil = [](MutableBytes now, const Bytes8& before) { std::copy(before.begin(), before.end(), now.begin()); };
    });
    for (std::size_t at = 0; at < std::min<std::size_t>(memory, 160); ++at) {
      all.push_back([=](Disobedient& one) {
        one.change = change;
        one.spoil = [at](MutableBytes now, const Bytes8&) { now[at] ^= 0x55; };
      });
    }
  }
  return all;
}

std::vector<std::string> not_kept(const Conformance& conformance) {
  std::vector<std::string> ids;
  for (const ClauseResult& one : conformance.clauses) {
    if (one.verdict != Verdict::kept) ids.emplace_back(one.id);
  }
  return ids;
}

TEST_P(ChangingClauses, EachIsBrokenByAMutantAlone) {
  const Bench good(address());
  const Bytes8 before = good.memory();
  const Conformance held = good.run();
  EXPECT_TRUE(all_kept(held)) << held.report();
  EXPECT_EQ(good.memory(), before);
  EXPECT_EQ(good.device->violation_count(), 0U) << good.device->violations()[0].rule;
  std::size_t tried = 0;
  for (const Clause* const clause : changing(*GetParam())) {
    bool found = false;
    std::string last;
    for (const Spoil& spoil : spoils_of(address(), *clause, before.size())) {
      ++tried;
      const Bench bench(address());
      spoil(*bench.mutant);
      const Conformance mutant = bench.run();
      last = mutant.report();
      found = not_kept(mutant) == std::vector<std::string>{std::string(clause->id)};
      if (found) break;
    }
    EXPECT_TRUE(found) << clause->id << "\n" << last;
  }
  std::printf("%s: %zu clauses that change, %zu mutants\n", std::string(GetParam()->id).c_str(),
              changing(*GetParam()).size(), tried);
}

TEST_P(ChangingClauses, LeaveTheMemoryAsItWasWhateverStepIsTheLast) {
  const Bench whole(address());
  const Bytes8 before = whole.memory();
  ASSERT_TRUE(all_kept(whole.run()));
  const unsigned steps = whole.port->steps;
  const std::string settings = whole.settings();
  // Of long ones each step has one of the three ends.
  const unsigned kinds = steps < 1000 ? 3 : 1;
  const unsigned stride = 10 / test_cases(10);
  for (unsigned i = 0; i < steps * kinds; i += stride) {
    const unsigned at = 1 + i / kinds;
    const unsigned kind = i % 3;
    const Bench bench(address());
    bench.port->at = at;
    bool over = false;
    bench.port->end = [&] {
      if (kind == 0) throw os::Interrupted{};
      if (kind == 1) throw os::Failure(os::Failure::Kind::lost, "the line is lost for a moment");
      over = true;
    };
    bool ended = false;
    try {
      static_cast<void>(bench.run([&] { return over; }));
    } catch (const os::Interrupted&) {
      ended = kind == 0;
    } catch (const os::Failure&) {
      ended = kind == 1;
    } catch (const Cancelled&) {
      ended = kind == 2;
    }
    EXPECT_TRUE(ended || kind != 0) << at;  // while it puts back, a moment without a line does no harm
    ASSERT_EQ(bench.memory(), before) << "end " << kind << " at " << at << " of " << steps;
    ASSERT_EQ(bench.settings(), settings) << "end " << kind << " at " << at << " of " << steps;
  }
  std::printf("%s: ended at each of %u steps\n", std::string(GetParam()->id).c_str(), steps);
}

INSTANTIATE_TEST_SUITE_P(Units, ChangingClauses, ::testing::ValuesIn([] {
                           std::vector<const Unit*> units;
                           for (const Unit* unit : all_units()) {
                             if (!changing(*unit).empty()) units.push_back(unit);
                           }
                           return units;
                         }()),
                         [](const auto& one) {
                           std::string name(one.param->id);
                           for (char& letter : name) letter = letter == '-' ? '_' : letter;
                           return name;
                         });

// What cannot be put back is said, with what puts it back.
TEST(Conformance, SaysHowToPutBackWhatALostLineLeftChanged) {
  const EncoderAddress address = parse_address("sim:tformat");
  const Bench whole(address);
  const Bytes8 before = whole.memory();
  ASSERT_TRUE(all_kept(whole.run()));
  unsigned changed = 0;
  for (unsigned at = 1; at <= whole.port->steps; ++at) {
    const Bench bench(address);
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

TEST(Conformance, ResetsNothingThatNothingCouldBringBack) {
  const Bench bench(parse_address("sim:tformat?multiturn=7"));
  EXPECT_EQ(not_kept(bench.run()), std::vector<std::string>{"reset-multiturn"});
  const Bench alarmed(parse_address("sim:tformat?alarm=over_heat"));
  EXPECT_EQ(not_kept(alarmed.run()), (std::vector<std::string>{"clear-alarms", "reset-multiturn"}));
}

}  // namespace
}  // namespace absenc::client
