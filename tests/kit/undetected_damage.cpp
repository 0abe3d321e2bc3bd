// SPDX-License-Identifier: Apache-2.0
#include "tests/kit/undetected_damage.hpp"

#include <algorithm>

#include "absenc/sim/place.hpp"

namespace absenc::kit {
namespace {

/// A device that sends the same reply to every request; a faulty line damages the reply.
template <class Item>
class FixedReplyDevice final : public Machine<Item> {
 public:
  explicit FixedReplyDevice(std::vector<Item> reply, std::size_t bits) : reply_(std::move(reply)), bits_(bits) {}
  void feed(const Event<Item>& event) override {
    using Kind = typename Event<Item>::Kind;
    if (event.kind == Kind::received) reply_due_ = true;
    if (event.kind == Kind::sent) reply_due_ = false;
  }
  Step<Item> next(Time) override {
    using Kind = typename Step<Item>::Kind;
    if (!reply_due_) return {};
    return {.kind = Kind::transfer, .out = reply_, .bits = bits_};
  }

 private:
  std::vector<Item> reply_;
  std::size_t bits_;
  bool reply_due_ = false;
};

/// States whether the position that was decoded from a damaged reply is wrong, and whether other fields are wrong.
struct WrongValues {
  bool position = false;
  bool others = false;
};

struct Judge {
  const Unit& unit;
  const Options& options;
  const OwnedFrame& request;
  const OwnedFrame& reply;
  ReportedFields right = [this] {
    ReportedFields seen;
    (void)unit.decode(options, request.frame(), reply.frame(), seen);
    return seen;
  }();

  void judge(const OwnedFrame& frame, WrongValues& wrong) const {
    ReportedFields seen;
    if (unit.decode(options, request.frame(), frame.frame(), seen) != Error::none) return;
    const bool elsewhere = !sim::same_place(seen.reading, right.reading);
    wrong.position = wrong.position || elsewhere;
    wrong.others = wrong.others || (!elsewhere && seen.fields != right.fields);
  }
  [[nodiscard]] WrongValues judge(Bytes bytes) const {
    WrongValues wrong;
    OwnedFrame part{.link = unit.link, .bytes = Wire(bytes.begin(), bytes.end())};
    if (carries_bits(unit.link)) {
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

void DamagedReplies::judge(const std::string& command, Findings& findings) const {
  if (!undetected) return;
  const auto judge_kind = [&](std::uint64_t accepted, const DamageCount& share, const char* what) {
    const std::uint64_t allowed = share.allowed(count);
    const auto text = [&] {
      return command + ": of " + std::to_string(count) + " damaged replies " + std::to_string(accepted) +
             " were taken for good with another " + what + "; the check lets " + std::to_string(allowed) +
             " pass; the first: " + example;
    };
    findings.require(accepted <= allowed, text);
    if (accepted > 0) findings.note(text());
  };
  judge_kind(wrong_positions, undetected->position, "position");
  judge_kind(wrong_values, undetected->others, "value");
}

UndetectedDamage measure_undetected_damage(const Unit& unit, const Options& options, const OwnedFrame& request,
                                           const OwnedFrame& reply, const sim::FaultRates& rates, unsigned samples) {
  std::uint64_t damaged = 0;
  UndetectedDamage undetected;
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
      const WrongValues found = step.kind == Step<Item>::Kind::transfer ? wrong(step.out) : WrongValues{};
      undetected.position.wrong += found.position ? 1 : 0;
      undetected.others.wrong += found.others ? 1 : 0;
      now += std::chrono::seconds(1);
      faulty.feed({.kind = Event<Item>::Kind::timer, .at = now});
      if (step.kind == Step<Item>::Kind::transfer) faulty.feed({.kind = Event<Item>::Kind::sent, .at = now});
    }
  };
  if (unit.link == LinkKind::can) {
    FixedReplyDevice<CanFrame> device({*reply.can}, 0);
    sim::FaultyNode faulty(device, rates, 1);
    sample(faulty, std::vector{request.can.value_or(CanFrame{})}, [&](std::span<const CanFrame> frames) {
      WrongValues wrong;
      for (const CanFrame& one : frames) judge.judge({.link = unit.link, .can = one}, wrong);
      return wrong;
    });
  } else {
    FixedReplyDevice<std::uint8_t> device(reply.bytes, reply.bits);
    sim::FaultyDevice faulty(device, rates, 1);
    sample(faulty, request.bytes.empty() ? Wire{0} : request.bytes, [&](Bytes bytes) { return judge.judge(bytes); });
  }
  undetected.position.damaged = undetected.others.damaged = std::max<std::uint64_t>(damaged, 1);
  return undetected;
}

}  // namespace absenc::kit
