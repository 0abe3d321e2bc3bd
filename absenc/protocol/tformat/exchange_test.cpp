// SPDX-License-Identifier: Apache-2.0
// A million random exchanges of host and virtual encoder over a line with every kind of fault: nothing wrong is
// accepted that the checks of the frame could have caught, nothing hangs, and the host breaks no rule.
#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "absenc/host/guarded_host_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/tformat/bench_test.hpp"
#include "absenc/sim/faults.hpp"

namespace absenc::tformat {
namespace {

constexpr std::uint64_t exchanges_per_seed = 250'000;

/// What a careful reader of the specification checks, written down once more and bit by bit: true when nothing in
/// these bytes shows that they are wrong.
bool looks_right(Bytes request, Bytes reply) {
  if (request.empty() || reply.empty() || reply[0] != request[0]) return false;
  if (crc_bitwise(crc_parameters, reply.first(reply.size() - 1)) != reply.back()) return false;
  switch (request[0]) {
    case 0x02:
    case 0xBA:
    case 0xC2:
    case 0x62:
      return reply.size() == 6 && (reply[1] & 0xCF) == 0 && reply[4] < 2;
    case 0x8A:
      return reply.size() == 6 && (reply[1] & 0xCF) == 0 && reply[4] == 0;
    case 0x92:
      return reply.size() == 4 && (reply[1] & 0xCF) == 0 && reply[2] == 0x11;
    case 0x1A: {
      if (reply.size() != 11 || (reply[1] & 0xCF) != 0 || reply[4] > 1 || reply[5] != 0x11 || reply[8] != 0)
        return false;
      const bool counting = (reply[9] & 0x04) != 0;
      const bool alarm = (reply[9] & 0xF0) != 0;
      return counting == ((reply[1] & 0x10) != 0) && alarm == ((reply[1] & 0x20) != 0);
    }
    case 0x32:
      return reply.size() == 4 && reply[1] == request[1] && reply[2] == request[2];
    case 0xEA:
      return reply.size() == 4 && reply[1] == request[1];
    default:
      return false;
  }
}

class Campaign {
 public:
  Campaign(std::uint64_t seed, const sim::FaultRates& rates)
      : random_(seed), encoder_({}, shaft_), faulty_(encoder_, rates, seed) {
    encoder_.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line_.attach(sim::Role::device, faulty_);
  }

  void run(std::uint64_t exchanges) {
    for (const std::uint64_t end = exchanges; encoder_.answered() < end && !::testing::Test::HasFailure();) {
      shaft_.put(static_cast<std::int64_t>(random_.below(65536)), static_cast<std::int64_t>(random_.below(131072)));
      encoder_.set_turns(static_cast<std::uint32_t>(random_.below(65536)), line_.now());
      if (random_.chance(0.05)) encoder_.raise_alarms(1u << random_.below(8));
      if (random_.chance(0.02)) encoder_.lower_alarms(0xFF);
      one();
    }
    std::printf("%llu exchanges, %llu damaged, %llu accepted, %llu of them wrong but beyond what the checks can see\n",
                static_cast<unsigned long long>(encoder_.answered()),
                static_cast<unsigned long long>(faulty_.damaged_replies()), static_cast<unsigned long long>(accepted_),
                static_cast<unsigned long long>(undetectable_));
  }

  [[nodiscard]] std::uint64_t accepted() const { return accepted_; }
  [[nodiscard]] const sim::FaultyDevice& faulty() const { return faulty_; }
  [[nodiscard]] const VirtualEncoder& encoder() const { return encoder_; }

 private:
  template <class Procedure>
  const Procedure& converse(Procedure&& procedure, bool may_repeat = true) {
    changed_before_ = host::testing::changed_bytes(faulty_);
    EXPECT_TRUE(host_.run(procedure, 10s, may_repeat)) << "hangs";
    return procedure;
  }

  // `right`: what the host took from the reply is the truth.
  void judge(const Conversation<std::uint8_t>& conversation, bool right) {
    if (conversation.error() != Error::none) return;
    ++accepted_;
    if (right) return;
    ++undetectable_;
    EXPECT_NE(host::testing::changed_bytes(faulty_), changed_before_) << "wrong, though no byte was changed";
    EXPECT_TRUE(looks_right(conversation.exchange().sent, conversation.exchange().received))
        << ::testing::PrintToString(
               std::vector<int>(conversation.exchange().received.begin(), conversation.exchange().received.end()));
  }

  void one() {
    const std::uint64_t kind = random_.below(1000);
    if (kind < 940) {
      read(static_cast<DataId>(random_.below(4)));
    } else if (kind < 980) {
      read_memory();
    } else if (kind < 995) {
      write_memory();
    } else {
      reset();
    }
  }

  void read(DataId id) {
    const ReadPosition position = converse(ReadPosition({}, id));
    const Reply truth = encoder_.everything(line_.now());
    const Reply& got = position.reply();
    bool right = got.id != DataId::encoder_id || got.encoder_id == truth.encoder_id;
    if (got.id == DataId::multiturn || got.id == DataId::everything) right = right && got.multiturn == truth.multiturn;
    if (got.id == DataId::singleturn || got.id == DataId::everything)
      right = right && got.singleturn == truth.singleturn;
    if (got.id == DataId::everything) right = right && got.alarms == truth.alarms;
    judge(position, right);
  }

  void read_memory() {
    const auto page = static_cast<std::uint8_t>(random_.below(user_pages));
    const auto address = static_cast<std::uint8_t>(random_.below(page_addresses));
    const ReadMemory memory = converse(ReadMemory({}, page, address));
    const std::uint8_t truth = encoder_.memory()[std::size_t{page} * page_addresses + address];
    judge(memory, memory.error() != Error::none || memory.data()[0] == truth);
  }

  void write_memory() {
    const auto page = static_cast<std::uint8_t>(random_.below(user_pages));
    const auto address = static_cast<std::uint8_t>(random_.below(page_addresses));
    const auto value = static_cast<std::uint8_t>(random_.below(256));
    const WriteMemory write = converse(WriteMemory({}, page, address, value), false);
    judge(write, encoder_.memory()[std::size_t{page} * page_addresses + address] == value);
  }

  void reset() {
    const DataId id = std::array{DataId::clear_alarms, DataId::zero, DataId::reset_multiturn}[random_.below(3)];
    const Reset done = converse(Reset({}, id), false);
    const Reply truth = encoder_.everything(line_.now());
    const bool cleared = (truth.alarms & alarms::latched) == 0;
    judge(done,
          id == DataId::zero ? truth.singleturn == 0 : cleared && (id == DataId::clear_alarms || truth.multiturn == 0));
  }

  sim::Random random_;
  testing::TestShaft shaft_;
  VirtualEncoder encoder_;
  sim::FaultyDevice faulty_;
  sim::Line<std::uint8_t> line_{LinkKind::half_duplex, line_settings};
  host::testing::GuardedHost<std::uint8_t> host_{*find_unit("tformat"), line_};
  std::uint64_t changed_before_ = 0;  // before the present conversation
  std::uint64_t accepted_ = 0;
  std::uint64_t undetectable_ = 0;
};

using sim::FaultKind;

using sim::testing::damaged_replies;

void expect_every_fault(const Campaign& campaign, const sim::FaultRates& rates) {
  EXPECT_GT(campaign.accepted(), exchanges_per_seed / 4);
  for (std::size_t kind = 0; kind < rates.rates.size(); ++kind) {
    if (rates.rates[kind] == 0) continue;
    EXPECT_GT(campaign.faulty().count(static_cast<FaultKind>(kind)), exchanges_per_seed / 200)
        << sim::fault_names[kind];
  }
}

class TformatExchange : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(TformatExchange, QuarterOfAMillionWithDamagedReplies) {
  const sim::FaultRates rates = damaged_replies(0.1);
  Campaign campaign(GetParam(), rates);
  campaign.run(exchanges_per_seed);
  expect_every_fault(campaign, rates);
  for (const Violation& violation : campaign.encoder().violations()) {
    ADD_FAILURE() << violation.rule << " at " << violation.at.count() << " ns";
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, TformatExchange, ::testing::Values(1, 2, 3, 4));

// What the encoder hears is not what the host sent, so it may see rules broken that the host did not break: rarely.
TEST(TformatExchangeBothWays, QuarterOfAMillionWithDamagedRequestsToo) {
  sim::FaultRates rates = damaged_replies(0.1);
  rates[FaultKind::request_corrupt] = 0.02;
  Campaign campaign(5, rates);
  campaign.run(exchanges_per_seed);
  expect_every_fault(campaign, rates);
  EXPECT_LT(campaign.encoder().violation_count(), campaign.faulty().count(FaultKind::request_corrupt) / 200);
}

}  // namespace
}  // namespace absenc::tformat
