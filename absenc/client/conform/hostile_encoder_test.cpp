// SPDX-License-Identifier: Apache-2.0
// Checks that devices which are no encoder of the protocol keep no clause without evidence.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absenc/client/conform/evidence.hpp"
#include "absenc/client/conform/mutant_test.hpp"
#include "absenc/client/conform/readings.hpp"
#include "absenc/client/conform/strangers_test.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::client {
namespace {

using capture::ObservedExchange;
using capture::ObservedFrame;

/// A port that stores all exchanges, each with everything received until the next request.
template <class Item>
class TapPort final : public Port<Item> {
 public:
  struct Exchange {
    std::vector<Item> request{};
    std::size_t bits = 0;
    std::vector<Item> reply{};
  };

  explicit TapPort(Port<Item>& port) : port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const Step<Item>& step) override {
    if (step.kind == Step<Item>::Kind::transfer || step.kind == Step<Item>::Kind::pulse) {
      exchanges.push_back({.request = {step.out.begin(), step.out.end()}, .bits = step.bits});
    }
    port_.begin(step);
  }
  Event<Item> wait(const Step<Item>& step) override {
    const Event<Item> event = port_.wait(step);
    if (event.kind == Event<Item>::Kind::received) {
      exchanges.back().reply.insert(exchanges.back().reply.end(), event.items.begin(), event.items.end());
    }
    return event;
  }

  // the first exchange has no request: it holds the bytes or frames that were received before the first request
  std::vector<Exchange> exchanges{1};

 private:
  Port<Item>& port_;
};

/// A device that is no encoder: it replies to each request with the bytes or frames that `next` returns. If the encoder
/// at this address would send unsolicited frames, the device sends those bytes or frames unsolicited.
template <class Item>
class Stranger final : public Machine<Item> {
 public:
  using Next = std::function<std::vector<Item>()>;
  using Kind = typename Event<Item>::Kind;

  Stranger(const EncoderAddress& address, Next next) : next_(std::move(next)) {
    const Unit& unit = *address.unit;
    driven_ = host_clocks(unit.link);
    streams_ = unit.streams != nullptr && unit.streams(address.options);
    character_ = address.line.with_some_rate().character();
    answer_ = std::max<Time>(unit.timing.turnaround, 4 * character_);
  }

  void feed(const Event<Item>& event) override {
    if (event.kind == Kind::sent) sending_ = false;
    const bool is_request =
        event.kind == Kind::selected || event.kind == Kind::triggered || (event.kind == Kind::received && !driven_);
    if (!is_request || sending_) return;
    reply_items_ = next_();
    if (reply_items_.empty()) return;
    pending_ = true;
    at_ = driven_ ? event.at : event.at + answer_;
  }
  Step<Item> next(Time now) override {
    constexpr Time period = std::chrono::milliseconds(10);
    if (streams_ && !sending_ && !pending_ && now >= due_) {
      due_ = now + period;
      reply_items_ = next_();
      pending_ = !reply_items_.empty();
      at_ = now;
    }
    if (pending_ && !sending_) {
      pending_ = false;
      sending_ = !driven_;
      return {.kind = Step<Item>::Kind::transfer, .out = reply_items_, .at = at_};
    }
    return {.at = streams_ ? due_ : never};
  }

 private:
  Next next_;
  bool driven_ = false;
  bool streams_ = false;
  Time character_{};
  Time answer_{};
  std::vector<Item> reply_items_;
  Time at_{};
  Time due_{};
  bool pending_ = false;
  bool sending_ = false;
};

/// Returns a good reply of the encoder at this address; empty if the encoder cannot be read.
template <class Item>
std::vector<Item> reply_of(const EncoderAddress& address) {
  VirtualDevice device(*address.unit, address.options, address.device);
  device.power_on(Time{});
  sim::RoughLine<Item> line(address.unit->link, address.line.with_some_rate(), machine_of<Item>(device), 1);
  std::vector<std::byte> storage(address.unit->host_storage);
  host::Session<Item> session(*address.unit, address.options, line, storage);
  const Conversation<Item>* const ended = session.run(*find_command(*address.unit, Verb::read));
  if (ended == nullptr || ended->error() != Error::none) return {};
  const std::span<const Item> reply_items = line.reply().empty() ? ended->exchange().received : line.reply();
  return {reply_items.begin(), reply_items.end()};
}

/// Returns a good reply of an encoder with another address; empty if there is none.
template <class Item>
std::vector<Item> reply_of_neighbour(const EncoderAddress& address) {
  EncoderAddress other = address;
  for (std::size_t i = 0; i < address.unit->options.size(); ++i) {
    const Option& option = address.unit->options[i];
    if (option.role != Role::encoder) continue;
    other.options.values[i] += other.options.values[i] == option.maximum ? -option.step : option.step;
    return reply_of<Item>(other);
  }
  return {};
}

bool is_same_kind(const Unit& one, const Unit& other) {
  const auto kind = [](const Unit& unit) {
    if (unit.link == LinkKind::can) return 0;
    return carries_bits(unit.link) ? 1 : 2;
  };
  return kind(one) == kind(other);
}

template <class Item>
std::vector<Item> zeros(const std::vector<Item>& like) {
  std::vector<Item> items(like.size());
  if constexpr (std::is_same_v<Item, CanFrame>) {
    for (std::size_t i = 0; i < like.size(); ++i) items[i].size = like[i].size;
  }
  return items;
}

template <class Item>
ObservedFrame frame_of(const std::vector<Item>& items, std::size_t bits = 0) {
  ObservedFrame frame;
  if constexpr (std::is_same_v<Item, CanFrame>) {
    if (!items.empty()) frame.can = items.back();
  } else {
    frame.bytes = items;
    frame.bits = std::min(bits, items.size() * 8);
  }
  return frame;
}

/// Counts the good frames that `tap` stored, without frames whose bits are all equal (`is_flat`); some may count twice.
template <class Item>
std::size_t good_replies(EncoderAddress address, const Clause& clause, const TapPort<Item>& tap) {
  const Unit& unit = *address.unit;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (unit.options[i].name == clause.option) address.options.values[i] = clause.value;
  }
  std::size_t good = 0;
  for (const auto& one : tap.exchanges) {
    if (one.reply.empty() || is_flat(frame_of(one.reply, one.bits))) continue;
    const ObservedFrame request = frame_of(one.request);
    good += unit.check(address.options, request.frame(), frame_of(one.reply, one.bits).frame()) == Error::none;
    if (!one.request.empty() || unit.link == LinkKind::clocked) continue;
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      for (std::size_t at = 0; at < one.reply.size(); ++at) {
        const Bytes rest = Bytes(one.reply).subspan(at);
        const FrameEnd end = unit.frame_end(address.options, Direction::reply, rest);
        if (end.kind != FrameEnd::Kind::complete) continue;
        good += unit.check(address.options, {}, {.bytes = rest.first(end.size)}) == Error::none;
      }
    } else {
      for (const CanFrame& frame : one.reply) good += unit.check(address.options, {}, {.can = &frame}) == Error::none;
    }
  }
  return good;
}

/// Returns whether `tap` stored the request of the clause; if that request is not known, whether it stored several
/// different ones.
template <class Item>
bool was_sent(const EncoderAddress& address, const Clause& clause, const TapPort<Item>& tap) {
  const Unit& unit = *address.unit;
  std::vector<std::uint8_t> wanted(longest_request);
  Result<std::size_t> size = Error::unsupported;
  if (clause.demand == Demand::reacts || clause.demand == Demand::page_closed) {
    wanted = request_of_ask(unit, address.options, clause.ask);
    size = wanted.size();
  }
  if (!clause.command.empty()) size = unit.encode(address.options, *find_command(unit, clause.command), {}, wanted);
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    if (size && *size > 0) {
      wanted.resize(*size);
      return std::ranges::any_of(tap.exchanges, [&](const auto& one) { return one.request == wanted; });
    }
  }
  // The clause has no request in bytes, as on CAN, so two different requests are taken as proof.
  std::set<std::string> different;
  for (const auto& one : tap.exchanges) {
    if (!one.request.empty()) different.insert(to_wire_text(unit.link, frame_of(one.request).frame()));
  }
  return different.size() > 1;
}

bool sends_other_requests(Demand demand) { return demand >= Demand::does; }

template <class Item>
Conformance judge(const EncoderAddress& address, Machine<Item>& machine, const ConformChoices& choices,
                  std::string_view who) {
  Link link;
  put_on_line(link, address, machine, {.rough = sim::RoughRates{}});
  std::unique_ptr<TapPort<Item>> tap;
  if constexpr (std::is_same_v<Item, CanFrame>) {
    tap = std::make_unique<TapPort<Item>>(*link.frames);
    link.frames = tap.get();
  } else {
    tap = std::make_unique<TapPort<Item>>(*link.bytes);
    link.bytes = tap.get();
  }
  const Conformance found = conform(address, std::move(link), choices, "NAME");
  for (const Clause& clause : clauses_of(*address.unit)) {
    if (verdict_of(found, clause.id) != Verdict::kept) continue;
    EXPECT_GT(good_replies(address, clause, *tap), 0U)
        << variation_name(address) << ", " << who << ": " << clause.id << "\n"
        << found.report();
    EXPECT_TRUE(!sends_other_requests(clause.demand) || was_sent(address, clause, *tap))
        << variation_name(address) << ", " << who << ": " << clause.id << "\n"
        << found.report();
  }
  return found;
}

template <class Item>
void check_strangers(const EncoderAddress& address, const ConformChoices& choices) {
  const auto judged_with = [&](std::string_view who, const typename Stranger<Item>::Next& next) {
    Stranger<Item> stranger(address, next);
    return judge<Item>(address, stranger, choices, who);
  };
  const std::vector<Item> own = reply_of<Item>(address);
  const Conformance silence = judged_with("silence", [] { return std::vector<Item>{}; });
  EXPECT_EQ(with_verdict(silence, Verdict::kept), std::vector<std::string>{}) << variation_name(address) << "\n"
                                                                              << silence.report();
  sim::Random random(1);
  judged_with("noise", [&] { return noise<Item>(random, own.size() + 3); });
  judged_with("zeros", [&] { return zeros(own); });
  judged_with("one reply for ever", [&] { return own; });
  if (const std::vector<Item> reply_items = reply_of_neighbour<Item>(address); !reply_items.empty()) {
    judged_with("a neighbour", [&] { return reply_items; });
  }
  for (const Unit* const other : all_units()) {
    if (other == address.unit || !is_same_kind(*other, *address.unit)) continue;
    const std::vector<Item> reply_items = reply_of<Item>(polled_address(fmt::format("sim:{}", other->id)));
    if (!reply_items.empty()) judged_with(other->id, [&] { return reply_items; });
  }
}

// Judges a virtual encoder of the unit whose every reply, or every second reply, is damaged.
template <class Item>
void check_damaged_line(const EncoderAddress& address, const ConformChoices& choices) {
  for (const unsigned every : {1u, 2u}) {
    VirtualDevice device(*address.unit, address.options, address.device);
    device.power_on(Time{});
    Mutant<Item> mutant(machine_of<Item>(device), address.unit->link);
    sim::Random random(every);
    unsigned replies = 0;
    mutant.always = true;
    mutant.mutated = 0;
    mutant.change_reply = [&](std::vector<Item>& reply_items, Step<Item>&) {
      if (reply_items.empty() || replies++ % every != 0) return;
      if constexpr (std::is_same_v<Item, CanFrame>) {
        reply_items.front().data[random.below(8)] ^= static_cast<std::uint8_t>(1 + random.below(255));
      } else {
        reply_items[random.below(reply_items.size())] ^= static_cast<std::uint8_t>(1 + random.below(255));
      }
    };
    judge<Item>(address, mutant, choices, every == 1 ? "all damaged" : "every second one damaged");
  }
}

template <class Item>
void check(const Unit& unit) {
  std::size_t variations = 0;
  for (const EncoderAddress& address : variations_of(unit)) {
    const bool usual = variations++ == 0;
    const ConformChoices choices{.readings = 5, .changes = usual, .resets = usual};
    try {
      check_strangers<Item>(address, choices);
      check_damaged_line<Item>(address, choices);
    } catch (const UsageError&) {
      EXPECT_FALSE(usual);  // only options that are not the defaults may make reading impossible
    }
  }
  std::printf("%s: %zu variations\n", std::string(unit.id).c_str(), variations);
}

class HostileEncoders : public ::testing::TestWithParam<const Unit*> {};

TEST_P(HostileEncoders, KeepNoClauseWithoutEvidence) {
  if (GetParam()->link == LinkKind::can) {
    check<CanFrame>(*GetParam());
  } else {
    check<std::uint8_t>(*GetParam());
  }
}

// Checks that the encoder breaks no clause; does nothing if it cannot be read.
template <class Item>
void check_good_one(const EncoderAddress& address) {
  if (reply_of<Item>(address).empty()) return;
  const Conformance found = conform(address, virtual_link(address, {.rough = sim::RoughRates{}}), {.readings = 5});
  EXPECT_EQ(with_verdict(found, Verdict::broken), std::vector<std::string>{}) << variation_name(address) << "\n"
                                                                              << found.report();
}

TEST_P(HostileEncoders, VirtualEncoderBreaksNoClauseWithAnyOption) {
  for (const EncoderAddress& address : variations_of(*GetParam())) {
    if (GetParam()->link == LinkKind::can) {
      check_good_one<CanFrame>(address);
    } else {
      check_good_one<std::uint8_t>(address);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Units, HostileEncoders, ::testing::ValuesIn(all_units().begin(), all_units().end()),
                         [](const auto& one) { return test_name(*one.param); });

}  // namespace
}  // namespace absenc::client
