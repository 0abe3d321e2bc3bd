// SPDX-License-Identifier: Apache-2.0
// A million random exchanges of host and virtual encoder over a line with every kind of fault: nothing wrong is
// accepted, nothing hangs, and the host breaks no rule.
#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "absenc/host/guarded_host_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/esl/bench_test.hpp"
#include "absenc/sim/faults.hpp"

namespace absenc::esl {
namespace {

constexpr std::uint64_t exchanges_per_seed = 250'000;

/// What a careful reader of the document checks first, written down once more and bit by bit: length, echo and CRC of
/// each channel.
bool looks_right(Bytes request, Bytes reply) {
  if (request.empty() || reply.empty() || reply[0] != request[0]) return false;
  static constexpr std::array<std::array<unsigned, 3>, 16> lengths{{{},
                                                                    {11, 7, 2},
                                                                    {9, 7, 2},
                                                                    {},
                                                                    {8, 0, 1},
                                                                    {6, 0, 1},
                                                                    {6, 5, 1},
                                                                    {},
                                                                    {6, 6, 2},
                                                                    {4, 0, 1},
                                                                    {4, 4, 1},
                                                                    {9, 7, 2},
                                                                    {7, 6, 1},
                                                                    {6, 0, 1},
                                                                    {4, 0, 1},
                                                                    {4, 0, 1}}};
  const auto [one, two, crc_bytes] = lengths[reply[0] >> 3 & 0xF];
  if (one == 0 || reply.size() != one + two || (two != 0 && reply[one] != request[0])) return false;
  const auto holds = [crc_size = crc_bytes](Bytes channel, std::uint16_t init) {
    std::vector<std::uint8_t> covered(channel.begin(), channel.end() - crc_size);
    if (crc_size == 1) return crc_bitwise(crc8_lsb, covered) == channel.back();
    if (covered.size() % 2 != 0) covered.push_back(0);
    CrcParameters parameters = crc16_lsb;
    parameters.init = init;
    return crc_bitwise(parameters, covered) == (channel[channel.size() - 2] | channel.back() << 8);
  };
  return holds(reply.first(one), 0) && (two == 0 || holds(reply.subspan(one), crc_bytes == 2 ? 0xFFFF : 0));
}

class Campaign {
 public:
  Campaign(std::uint64_t seed, const sim::FaultRates& rates)
      : random_(seed), encoder_({}, shaft_), faulty_(encoder_, rates, seed) {
    encoder_.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line_.attach(sim::Role::device, faulty_);
  }

  void run(std::uint64_t exchanges) {
    while (encoder_.answered() < exchanges && !::testing::Test::HasFailure()) {
      shaft_.put(static_cast<std::int64_t>(random_.below(65536)), static_cast<std::int64_t>(random_.below(1 << 24)));
      if (random_.chance(0.05)) encoder_.raise_alarms(1u << random_.below(8));
      if (random_.chance(0.02)) encoder_.lower_alarms(0xFF);
      one();
    }
    std::printf(
        "%llu exchanges, %llu damaged, %llu accepted, %llu safe, %llu wrong but beyond what the checks can see\n",
        static_cast<unsigned long long>(encoder_.answered()),
        static_cast<unsigned long long>(faulty_.damaged_replies()), static_cast<unsigned long long>(accepted_),
        static_cast<unsigned long long>(safe_), static_cast<unsigned long long>(undetectable_));
  }

  [[nodiscard]] std::uint64_t accepted() const { return accepted_; }
  [[nodiscard]] std::uint64_t safe() const { return safe_; }
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
    if (kind < 700) {
      static constexpr std::array ids{DataId::position,         DataId::singleturn,  DataId::position_short,
                                      DataId::singleturn_short, DataId::calibration, DataId::encoder_id,
                                      DataId::temperature,      DataId::alarms};
      read(ids[random_.below(ids.size())]);
    } else if (kind < 950) {
      read_safely();
    } else if (kind < 980) {
      read_memory();
    } else if (kind < 995) {
      write_memory();
    } else {
      reset();
    }
  }

  void read(DataId id) {
    const Read read = converse(Read({}, id));
    const Reply truth = encoder_.reply_to(id, line_.now());
    const ReplyBytes got = encode_reply({}, read.reply());
    const ReplyBytes wanted = encode_reply({}, truth);
    judge(read, std::equal(got.view().begin(), got.view().end(), wanted.view().begin(), wanted.view().end()));
  }

  void read_safely() {
    const ReadSafePosition read = converse(ReadSafePosition({}));
    if (read.position() == nullptr) return;
    ++safe_;
    ++accepted_;
    const Reply truth = encoder_.reply_to(DataId::position, line_.now());
    EXPECT_EQ(read.position()->singleturn(), truth.singleturn);
    EXPECT_EQ(truth.one.alarms & alarms::unsafe, 0);
  }

  void read_memory() {
    const auto page = static_cast<std::uint8_t>(random_.below(4));
    const auto address = static_cast<std::uint8_t>(random_.below(last_address + 1));
    const ReadMemory memory = converse(ReadMemory({}, page, address));
    judge(memory, memory.error() != Error::none || memory.data()[0] == *encoder_.stored(page, address));
  }

  void write_memory() {
    const auto page = static_cast<std::uint8_t>(random_.below(4));
    const auto address = static_cast<std::uint8_t>(random_.below(last_address + 1));
    const auto value = static_cast<std::uint8_t>(random_.below(256));
    const WriteMemory write = converse(WriteMemory({}, page, address, value), false);
    judge(write, *encoder_.stored(page, address) == value);
  }

  void reset() {
    const DataId id = std::array{DataId::clear_alarms, DataId::zero, DataId::reset_multiturn}[random_.below(3)];
    const Reset done = converse(Reset({}, id), false);
    const Reply truth = encoder_.reply_to(DataId::position, line_.now());
    if (id == DataId::zero) return judge(done, truth.singleturn == 0);
    judge(done, id == DataId::clear_alarms ? truth.one.alarms == 0 : truth.multiturn == 0);
  }

  sim::Random random_;
  testing::TestShaft shaft_;
  VirtualEncoder encoder_;
  sim::FaultyDevice faulty_;
  sim::Line<std::uint8_t> line_{LinkKind::half_duplex, line_settings};
  host::testing::GuardedHost<std::uint8_t> host_{*find_unit("esl"), line_};
  std::uint64_t changed_before_ = 0;  // before the present conversation
  std::uint64_t accepted_ = 0;
  std::uint64_t safe_ = 0;
  std::uint64_t undetectable_ = 0;
};

using sim::FaultKind;

using sim::testing::damaged_replies;

void expect_every_fault(const Campaign& campaign, const sim::FaultRates& rates) {
  EXPECT_GT(campaign.accepted(), exchanges_per_seed / 4);
  EXPECT_GT(campaign.safe(), exchanges_per_seed / 50);
  for (std::size_t kind = 0; kind < rates.rates.size(); ++kind) {
    if (rates.rates[kind] == 0) continue;
    EXPECT_GT(campaign.faulty().count(static_cast<FaultKind>(kind)), exchanges_per_seed / 200)
        << sim::fault_names[kind];
  }
}

class EslExchange : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(EslExchange, QuarterOfAMillionWithDamagedReplies) {
  const sim::FaultRates rates = damaged_replies(0.1);
  Campaign campaign(GetParam(), rates);
  campaign.run(exchanges_per_seed);
  expect_every_fault(campaign, rates);
  for (const Violation& violation : campaign.encoder().violations()) {
    ADD_FAILURE() << violation.rule << " at " << violation.at.count() << " ns";
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, EslExchange, ::testing::Values(1, 2, 3));

// What the encoder hears is not what the host sent, so it may see rules broken that the host did not break: rarely.
TEST(EslExchangeBothWays, QuarterOfAMillionWithDamagedRequestsToo) {
  sim::FaultRates rates = damaged_replies(0.1);
  rates[FaultKind::request_corrupt] = 0.02;
  Campaign campaign(4, rates);
  campaign.run(exchanges_per_seed);
  expect_every_fault(campaign, rates);
  EXPECT_LT(campaign.encoder().violation_count(), campaign.faulty().count(FaultKind::request_corrupt) / 200);
}

}  // namespace
}  // namespace absenc::esl
