// SPDX-License-Identifier: Apache-2.0
// A million random frames of host and virtual encoder over a UART with every kind of fault: no wrong position is
// accepted that its checks could have caught, no register gets or gives a wrong value, nothing hangs.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

#include "absenc/host/guarded_host_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/encolink/bench_test.hpp"
#include "absenc/sim/faults.hpp"

namespace absenc::encolink {
namespace {

using sim::FaultKind;

constexpr std::uint64_t frames_per_seed = 200'000;

/// What a careful reader checks, written down once more and bit by bit: nothing in these bytes shows that they are
/// wrong.
bool looks_right(Bytes reply) {
  return reply.size() == 7 && crc_bitwise(crc_parameters, reply.first(5)) == reply[5] && (reply[4] & 0x0C) == 0;
}

class Campaign {
 public:
  Campaign(std::uint64_t seed, const sim::FaultRates& rates, double register_share)
      : random_(seed),
        register_share_(register_share),
        encoder_(testing::multi, shaft_),
        faulty_(encoder_, rates, seed) {
    encoder_.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line_.attach(sim::Role::device, faulty_);
  }

  void run(std::uint64_t frames) {
    while (encoder_.answered() < frames && !::testing::Test::HasFailure()) {
      shaft_.put(static_cast<std::int64_t>(random_.below(65536)), static_cast<std::int64_t>(random_.below(1u << 20)));
      if (random_.chance(0.002)) encoder_.raise_alarms(1u << random_.below(16));
      if (random_.chance(0.02)) encoder_.lower_alarms(0xFFFF);
      if (!random_.chance(register_share_)) {
        read_position();
      } else if (random_.chance(0.5)) {
        read_register();
      } else {
        write_register();
      }
    }
    std::printf("%llu frames, %llu damaged; %llu positions accepted (%llu wrong, beyond the checks), registers: %llu\n",
                static_cast<unsigned long long>(encoder_.answered()),
                static_cast<unsigned long long>(faulty_.damaged_replies()), static_cast<unsigned long long>(accepted_),
                static_cast<unsigned long long>(undetectable_), static_cast<unsigned long long>(registers_));
  }

  [[nodiscard]] std::uint64_t accepted() const { return accepted_; }
  [[nodiscard]] std::uint64_t wrong_alarms() const { return wrong_alarms_; }
  [[nodiscard]] std::uint64_t register_accesses() const { return registers_; }
  [[nodiscard]] const sim::FaultyDevice& faulty() const { return faulty_; }
  [[nodiscard]] const VirtualEncoder& encoder() const { return encoder_; }

 private:
  void converse(Conversation<std::uint8_t>& conversation, bool may_repeat) {
    changed_before_ = changed();
    EXPECT_TRUE(host_.run(conversation, 60s, may_repeat)) << "hangs";
  }
  testing::Told command(std::string_view name, std::vector<std::int64_t> arguments) {
    const testing::Made made(testing::multi, name, std::move(arguments));
    converse(*made, find_command(unit, name)->repeatable);
    return testing::told_by(*made);
  }
  // An echo, which this line cannot have, is bytes before the reply like any others: one in a thousand shifts what
  // comes into a good frame.
  [[nodiscard]] std::uint64_t changed() const {
    return host::testing::changed_bytes(faulty_) + faulty_.count(FaultKind::echo);
  }

  void read_position() {
    ReadPosition read(testing::multi);
    converse(read, true);
    if (read.error() != Error::none) return;
    ++accepted_;
    const Position truth = encoder_.measure(line_.now());
    const bool right = same_place(read.position(), truth) && read.position().error == truth.error &&
                       read.position().warning == truth.warning;
    if (!right) {
      ++undetectable_;
      EXPECT_NE(changed(), changed_before_) << "wrong, though no byte was changed";
      EXPECT_TRUE(looks_right(read.exchange().received));
    } else if (read.detailed_status() && *read.detailed_status() != encoder_.alarms()) {
      ++wrong_alarms_;
    }
  }

  void read_register() {
    testing::Told read = command("memory-read", {registers[serial_number].address});
    if (read.error != Error::none) return;
    ++registers_;
    EXPECT_EQ(read.texts["serial_number"], "AK2A0001");
  }

  void write_register() {
    const auto value = static_cast<std::uint32_t>(random_.next());
    const std::uint32_t before = encoder_.offset();
    const testing::Told write = command("memory-write", {0, value});
    EXPECT_TRUE(encoder_.offset() == value || encoder_.offset() == before);
    if (write.error != Error::none) return;
    ++registers_;
    EXPECT_EQ(encoder_.offset(), value);
  }

  sim::Random random_;
  double register_share_;
  testing::TestShaft shaft_;
  VirtualEncoder encoder_;
  sim::FaultyDevice faulty_;
  sim::Line<std::uint8_t> line_{LinkKind::full_duplex, uart_settings};
  static constexpr std::array<OptionText, 2> options_{{{"resolution", "20"}, {"multiturn_bits", "16"}}};
  host::testing::GuardedHost<std::uint8_t> host_{*find_unit("encolink"), line_, options_};
  std::uint64_t changed_before_ = 0;  // before the present conversation
  std::uint64_t accepted_ = 0;
  std::uint64_t undetectable_ = 0;
  std::uint64_t wrong_alarms_ = 0;
  std::uint64_t registers_ = 0;
};

using sim::testing::damaged_replies;

void expect_no_violation(const Campaign& campaign) {
  for (const Violation& violation : campaign.encoder().violations()) {
    ADD_FAILURE() << violation.rule << " at " << violation.at.count() << " ns";
  }
}

class EncolinkExchange : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(EncolinkExchange, PositionsOverADamagedWire) {
  const sim::FaultRates rates = damaged_replies(0.1);
  Campaign campaign(GetParam(), rates, 0.001);
  campaign.run(frames_per_seed);
  EXPECT_GT(campaign.accepted(), frames_per_seed / 4);
  EXPECT_LT(campaign.wrong_alarms(), campaign.accepted() / 1000);
  for (std::size_t kind = 0; kind < rates.rates.size(); ++kind) {
    if (rates.rates[kind] == 0) continue;
    EXPECT_GT(campaign.faulty().count(static_cast<FaultKind>(kind)), frames_per_seed / 200) << sim::fault_names[kind];
  }
  expect_no_violation(campaign);
}

INSTANTIATE_TEST_SUITE_P(Seeds, EncolinkExchange, ::testing::Values(1, 2));

// An access takes a hundred good frames in a row, so registers are reached over a better wire only.
TEST(EncolinkExchangeRegisters, OverAWireThatIsDamagedNowAndThen) {
  for (const std::uint64_t seed : std::array<std::uint64_t, 2>{3, 4}) {
    Campaign campaign(seed, damaged_replies(0.003), 0.5);
    campaign.run(frames_per_seed);
    EXPECT_GT(campaign.register_accesses(), 500u);
    expect_no_violation(campaign);
  }
}

// What the encoder hears is not what the host sent.
TEST(EncolinkExchangeBothWays, DamagedRequestsToo) {
  sim::FaultRates rates = damaged_replies(0.002);
  rates[FaultKind::request_corrupt] = 0.002;
  Campaign campaign(5, rates, 0.5);
  campaign.run(frames_per_seed);
  EXPECT_GT(campaign.register_accesses(), 300u);
  EXPECT_LT(campaign.encoder().violation_count(), 10u);
}

}  // namespace
}  // namespace absenc::encolink
