// SPDX-License-Identifier: Apache-2.0
#include "tests/kit/weight.hpp"

#include <algorithm>

#include "absenc/sim/place.hpp"

namespace absenc::kit {
namespace {

/// Sends the same reply to every request.
template <class Item>
class Parrot final : public Machine<Item> {
 public:
  explicit Parrot(std::vector<Item> reply, std::size_t bits) : reply_(std::move(reply)), bits_(bits) {}
  void feed(const Event<Item>& event) override {
    using Kind = typename Event<Item>::Kind;
    if (event.kind == Kind::received) speaks_ = true;
    if (event.kind == Kind::sent) speaks_ = false;
  }
  Step<Item> next(Time) override {
    using Kind = typename Step<Item>::Kind;
    if (!speaks_) return {};
    return {.kind = Kind::transfer, .out = reply_, .bits = bits_};
  }

 private:
  std::vector<Item> reply_;
  std::size_t bits_;
  bool speaks_ = false;
};

/// Kinds of wrong values that a damaged reply decoded to.
struct Wrong {
  bool position = false;
  bool others = false;
};

struct Judge {
  const Unit& unit;
  const Options& options;
  const Held& request;
  const Held& reply;
  Seen right = [this] {
    Seen seen;
    (void)unit.decode(options, request.frame(), reply.frame(), seen);
    return seen;
  }();

  void judge(const Held& frame, Wrong& wrong) const {
    Seen seen;
    if (unit.decode(options, request.frame(), frame.frame(), seen) != Error::none) return;
    const bool elsewhere = !sim::same_place(seen.reading, right.reading);
    wrong.position = wrong.position || elsewhere;
    wrong.others = wrong.others || (!elsewhere && seen.fields != right.fields);
  }
  [[nodiscard]] Wrong judge(Bytes bytes) const {
    Wrong wrong;
    Held part{.link = unit.link, .bytes = Wire(bytes.begin(), bytes.end())};
    if (unit.link == LinkKind::clocked) {
      part.bytes.resize(reply.bytes.size(), 0xFF);
      part.bits = reply.bits;
      judge(part, wrong);
      return wrong;
    }
    const bool anywhere = unit.streams != nullptr && unit.streams(options);
    for (std::size_t first = 0; first < (anywhere ? bytes.size() : 1); ++first) {
      for (std::size_t size = 1; size <= std::min(bytes.size() - first, reply.bytes.size() + 2); ++size) {
        part.bytes.assign(bytes.begin() + static_cast<std::ptrdiff_t>(first),
                          bytes.begin() + static_cast<std::ptrdiff_t>(first + size));
        judge(part, wrong);
      }
    }
    return wrong;
  }
};

}  // namespace

Weight weight_of(const Unit& unit, const Options& options, const Held& request, const Held& reply,
                 const sim::FaultRates& rates, unsigned samples) {
  std::uint64_t damaged = 0;
  Weight weight;
  const Judge judge{unit, options, request, reply};
  const auto sample = [&](auto& faulty, const auto& asks, auto&& wrong) {
    Time now{};
    for (unsigned i = 0; i < samples; ++i) {
      using Item = std::remove_cvref_t<decltype(asks[0])>;
      now += std::chrono::seconds(1);
      const auto before = faulty.counts();
      faulty.feed({.kind = Event<Item>::Kind::received, .at = now, .items = asks});
      const Step<Item> step = faulty.next(now);
      if (faulty.counts() == before) {
        faulty.feed({.kind = Event<Item>::Kind::sent, .at = now});
        continue;
      }
      ++damaged;
      const Wrong found = step.kind == Step<Item>::Kind::transfer ? wrong(step.out) : Wrong{};
      weight.position.wrong += found.position ? 1 : 0;
      weight.others.wrong += found.others ? 1 : 0;
      now += std::chrono::seconds(1);
      faulty.feed({.kind = Event<Item>::Kind::timer, .at = now});
      if (step.kind == Step<Item>::Kind::transfer) faulty.feed({.kind = Event<Item>::Kind::sent, .at = now});
    }
  };
  if (unit.link == LinkKind::can) {
    Parrot<CanFrame> parrot({*reply.can}, 0);
    sim::FaultyNode faulty(parrot, rates, 1);
    sample(faulty, std::vector{request.can.value_or(CanFrame{})}, [&](std::span<const CanFrame> frames) {
      Wrong wrong;
      for (const CanFrame& one : frames) judge.judge({.link = unit.link, .can = one}, wrong);
      return wrong;
    });
  } else {
    Parrot<std::uint8_t> parrot(reply.bytes, reply.bits);
    sim::FaultyDevice faulty(parrot, rates, 1);
    sample(faulty, request.bytes.empty() ? Wire{0} : request.bytes, [&](Bytes bytes) { return judge.judge(bytes); });
  }
  weight.position.damaged = weight.others.damaged = std::max<std::uint64_t>(damaged, 1);
  return weight;
}

}  // namespace absenc::kit
