// SPDX-License-Identifier: Apache-2.0
// A million random exchanges of host and virtual interface over a line with every kind of fault: nothing wrong is
// accepted that the checks could have caught, nothing hangs.
#include <gtest/gtest.h>

#include <cstdio>

#include "absenc/host/guarded_host_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/e201/bench_test.hpp"
#include "absenc/sim/faults.hpp"

namespace absenc::e201 {
namespace {

constexpr std::uint64_t exchanges_per_seed = 250'000;

/// What a careful reader of the document checks, written down once more and bit by bit.
bool looks_right(Bytes reply, unsigned bits) {
  if (reply.size() != 17 || reply[16] != '\r') return false;
  std::uint64_t samples = 0;
  for (const std::uint8_t c : reply.first(16)) {
    const auto digit = std::string_view("0123456789abcdef").find(static_cast<char>(c | 0x20));
    if (digit == std::string_view::npos) return false;
    samples = samples << 4 | digit;
  }
  const auto bit = [samples](unsigned i) { return static_cast<unsigned>(samples >> (63 - i) & 1); };
  if (bit(0) != 1 || bit(1) != 1 || bit(2) != 0) return false;
  unsigned at = 2;
  while (at < 64 && bit(at) == 0) ++at;
  at += 2;
  if (at + bits + 8 > 64 || bit(at - 1) != 0) return false;
  unsigned remainder = 0;
  for (unsigned i = 0; i < bits + 8; ++i) {
    remainder = remainder << 1 | (bit(at + i) ^ (i >= bits + 2 ? 1 : 0));
    if ((remainder & 0x40) != 0) remainder ^= 0x43;
  }
  return remainder == 0;
}

class Campaign {
 public:
  Campaign(std::uint64_t seed, const sim::FaultRates& rates)
      : random_(seed), adapter_(format_, shaft_), faulty_(adapter_, rates, seed) {
    adapter_.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line_.attach(sim::Role::device, faulty_);
  }

  void run() {
    for (std::uint64_t i = 0; i < exchanges_per_seed && !::testing::Test::HasFailure(); ++i) {
      shaft_.state.position = static_cast<std::int64_t>(random_.next());
      const std::uint64_t kind = random_.below(100);
      if (kind < 90) {
        read();
      } else if (kind < 95) {
        set_clock();
      } else {
        info();
      }
    }
    std::printf(
        "%llu commands, %llu replies damaged, %llu accepted, %llu of them wrong but beyond what the checks see\n",
        static_cast<unsigned long long>(adapter_.answered()),
        static_cast<unsigned long long>(faulty_.damaged_replies()), static_cast<unsigned long long>(accepted_),
        static_cast<unsigned long long>(undetectable_));
  }

  [[nodiscard]] std::uint64_t accepted() const { return accepted_; }
  [[nodiscard]] const sim::FaultyDevice& faulty() const { return faulty_; }
  [[nodiscard]] const VirtualAdapter& adapter() const { return adapter_; }

 private:
  template <class Procedure>
  const Procedure& converse(Procedure&& procedure, bool may_repeat = true) {
    line_.run_until(line_.now() + 1us);
    changed_before_ = host::testing::changed_bytes(faulty_);
    EXPECT_TRUE(host_.run(procedure, 10s, may_repeat)) << "hangs";
    return procedure;
  }

  void judge(const Conversation<std::uint8_t>& conversation, bool right) {
    if (conversation.error() != Error::none) return;
    ++accepted_;
    if (right) return;
    ++undetectable_;
    EXPECT_NE(host::testing::changed_bytes(faulty_), changed_before_) << "wrong, though no byte was changed";
  }

  void read() {
    const ReadPosition position = converse(ReadPosition(format_));
    const bool right = position.position().word == adapter_.word(line_.now());
    judge(position, right);
    if (position.error() != Error::none || right) return;
    EXPECT_TRUE(looks_right(position.exchange().received, 35));
  }

  // Not M7, M8: the ACK would be too long.
  void set_clock() {
    const auto clock = static_cast<unsigned>(1 + random_.below(6));
    const Set set = converse(Set(command::set_clock, clock), false);
    judge(set, adapter_.clock() == clock);
    // An interface that did not hear the M, because a stretched reply made it deaf, takes 1 for its stream.
    if (set.error() != Error::none) converse(Tell(command::stream_off), false);
    if (set.error() == Error::none && adapter_.clock() != clock) {
      EXPECT_EQ(find_clock(set.exchange().received), clock);  // a digit was changed into another one
    }
  }

  void info() { judge(converse(Info()), true); }

  sim::Random random_;
  Format format_ = testing::biss_format();
  testing::TestShaft shaft_;
  VirtualAdapter adapter_;
  sim::FaultyDevice faulty_;
  sim::Line<std::uint8_t> line_{LinkKind::full_duplex, line_settings};
  static constexpr std::array<OptionText, 2> options_{{{"singleturn_bits", "19"}, {"multiturn_bits", "16"}}};
  host::testing::GuardedHost<std::uint8_t> host_{*find_unit("e201"), line_, options_};
  std::uint64_t changed_before_ = 0;  // before the present conversation
  std::uint64_t accepted_ = 0;
  std::uint64_t undetectable_ = 0;
};

class E201Exchange : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(E201Exchange, QuarterOfAMillionWithDamagedReplies) {
  using sim::FaultKind;
  sim::FaultRates rates;
  for (const FaultKind kind : {FaultKind::drop, FaultKind::truncate, FaultKind::delay, FaultKind::echo,
                               FaultKind::garbage, FaultKind::silence, FaultKind::repeat}) {
    rates[kind] = 0.02;
  }
  rates[FaultKind::corrupt] = 0.1;
  rates.delay = 1ms;
  Campaign campaign(GetParam(), rates);
  campaign.run();
  EXPECT_GT(campaign.accepted(), exchanges_per_seed / 2);
  for (std::size_t kind = 0; kind < rates.rates.size(); ++kind) {
    if (rates.rates[kind] == 0) continue;
    EXPECT_GT(campaign.faulty().count(static_cast<FaultKind>(kind)), exchanges_per_seed / 100)
        << sim::fault_names[kind];
  }
  EXPECT_LT(campaign.adapter().violation_count(), exchanges_per_seed / 1000);  // of half a command, heard when deaf
}

INSTANTIATE_TEST_SUITE_P(Seeds, E201Exchange, ::testing::Values(1, 2, 3, 4));

}  // namespace
}  // namespace absenc::e201
