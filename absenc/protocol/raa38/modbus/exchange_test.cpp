// SPDX-License-Identifier: Apache-2.0
// A million random exchanges of host and virtual encoder over a Modbus line with every kind of fault: nothing wrong is
// accepted that the checks of the frame could have caught, nothing hangs, and the host breaks no rule.
#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "absenc/host/guarded_host_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/raa38/modbus/bench_test.hpp"
#include "absenc/sim/faults.hpp"

namespace absenc::raa38::rtu {
namespace {

using sim::FaultKind;
using sim::testing::damaged_replies;

constexpr std::uint64_t exchanges_per_seed = 250'000;

/// What a careful reader of the manual checks, written down once more and bit by bit: true when nothing in these bytes
/// shows that they are wrong.
bool looks_right(const Format& format, Bytes request, Bytes reply) {
  if (request.size() < 4 || reply.size() < 4) return false;
  const std::uint16_t crc = crc_bitwise(modbus::crc_parameters, reply.first(reply.size() - 2));
  const bool low_first = reply[reply.size() - 2] == (crc & 0xFF) && reply.back() == crc >> 8;
  const bool high_first = reply[reply.size() - 2] == crc >> 8 && reply.back() == (crc & 0xFF);
  switch (request[1]) {
    case 0x03: {
      if (!low_first || reply[0] != request[0] || reply[1] != 3) return false;
      const bool one = request[5] == 1 && reply.size() == 7 && reply[2] == 2;
      const bool three = request[5] == 2 && reply.size() == 8 && (reply[2] == 3 || reply[2] == 4);
      const bool four = request[5] == 2 && reply.size() == 9 && reply[2] == 4;
      if (!one && !three && !four) return false;
      std::uint64_t position = 0;
      for (std::size_t i = 3; i < reply.size() - 2; ++i) position = position * 256 + reply[i];
      return position < std::uint64_t{1} << format.bits;
    }
    case 0xA0:
      return (low_first || high_first) && reply.size() == 5 && reply[0] == 0xFF && reply[1] == 0xA0;
    case 0xA1:
      return low_first && reply.size() == 4 && reply[0] == request[2] && reply[1] == 0xA1;
    case 0xCC:
      return low_first && std::ranges::equal(request, reply);
    default:
      return false;
  }
}

/// Sets the host's end of the line.
class SetRate final : public Machine<std::uint8_t> {
 public:
  explicit SetRate(const LineSettings& line) : line_(line) {}
  void feed(const Event<std::uint8_t>&) override {}
  Step<std::uint8_t> next(Time) override {
    using Kind = Step<std::uint8_t>::Kind;
    return {.kind = std::exchange(done_, true) ? Kind::done : Kind::configure, .settings = line_};
  }

 private:
  LineSettings line_;
  bool done_ = false;
};

class Campaign {
 public:
  Campaign(const Format& format, Data data, std::uint64_t seed, const sim::FaultRates& rates)
      : format_(format), random_(seed), encoder_(format, shaft_, data), faulty_(encoder_, rates, seed) {
    encoder_.power_on(Time{}, testing::PowerOn::skip);
    line_.attach(sim::Role::device, faulty_);
  }

  void run(std::uint64_t exchanges) {
    while (encoder_.answered() < exchanges && !::testing::Test::HasFailure()) {
      shaft_.put(0, static_cast<std::int64_t>(random_.below(1u << 21)));
      one();
    }
    std::printf("%llu exchanges, %llu damaged, %llu accepted, %llu of them wrong but beyond what the checks can see\n",
                static_cast<unsigned long long>(encoder_.answered()),
                static_cast<unsigned long long>(faulty_.damaged_replies()), static_cast<unsigned long long>(accepted_),
                static_cast<unsigned long long>(undetectable_));
  }

  [[nodiscard]] std::uint64_t accepted() const { return accepted_; }
  [[nodiscard]] std::uint64_t undetectable() const { return undetectable_; }
  [[nodiscard]] const sim::FaultyDevice& faulty() const { return faulty_; }
  [[nodiscard]] const VirtualEncoder& encoder() const { return encoder_; }

 private:
  template <class Machine>
  Machine& converse(Machine& machine, bool may_repeat = true) {
    changed_before_ = host::testing::changed_bytes(faulty_);
    EXPECT_TRUE(host_.run(machine, 60s, may_repeat)) << "hangs";
    return machine;
  }

  // `right`: what the host took from the reply is the truth.
  void judge(const Conversation<std::uint8_t>& conversation, bool right) {
    if (conversation.error() != Error::none) return;
    ++accepted_;
    if (right) return;
    ++undetectable_;
    EXPECT_NE(host::testing::changed_bytes(faulty_), changed_before_) << "wrong, though no byte was changed";
    EXPECT_TRUE(looks_right(format_, conversation.exchange().sent, conversation.exchange().received))
        << ::testing::PrintToString(
               std::vector<int>(conversation.exchange().received.begin(), conversation.exchange().received.end()));
  }

  void one() {
    const std::uint64_t kind = random_.below(20'000);
    if (kind == 0) {
      set_address();
    } else if (kind == 1) {
      set_baud();
    } else if (kind == 2) {
      SetDirection set(format_, encoder_.counts_backwards() ? parameter::positive : parameter::negative);
      converse(set, false);
      judge(set, true);
    } else if (kind == 3) {
      Zero zero(format_);
      converse(zero, false);
      judge(zero, encoder_.singleturn(line_.now()) == 0);
    } else if (kind < 500) {
      ReadAddress read(format_);
      converse(read);
      judge(read, true);
    } else {
      ReadPosition read(format_);
      converse(read);
      judge(read, read.reading() == nullptr || read.reading()->singleturn == encoder_.singleturn(line_.now()));
    }
  }

  void set_address() {
    const auto address = static_cast<std::uint8_t>(1 + random_.below(247));
    SetAddress set(format_, address);
    converse(set, false);
    judge(set, encoder_.address() == address);
    format_.address = encoder_.address();
  }

  // Not slower than 19200: a million exchanges take long enough.
  void set_baud() {
    const std::size_t baud = 3 + random_.below(2);
    SetBaud set(format_, bauds[baud]);
    converse(set, false);
    judge(set, encoder_.baud() == bauds[baud]);
    format_.baud = *baud_index(encoder_.baud());
    SetRate again(format_.line());
    converse(again, false);
  }

  Format format_;
  sim::Random random_;
  testing::TestShaft shaft_;
  VirtualEncoder encoder_;
  sim::FaultyDevice faulty_;
  sim::Line<std::uint8_t> line_{LinkKind::half_duplex, line_settings};
  host::testing::GuardedHost<std::uint8_t> host_{*find_unit("raa38-modbus"), line_};
  std::uint64_t changed_before_ = 0;  // before the present conversation
  std::uint64_t accepted_ = 0;
  std::uint64_t undetectable_ = 0;
};

void expect_every_fault(const Campaign& campaign, const sim::FaultRates& rates) {
  EXPECT_GT(campaign.accepted(), exchanges_per_seed / 4);
  for (std::size_t kind = 0; kind < rates.rates.size(); ++kind) {
    if (rates.rates[kind] == 0) continue;
    EXPECT_GT(campaign.faulty().count(static_cast<FaultKind>(kind)), exchanges_per_seed / 200)
        << sim::fault_names[kind];
  }
}

struct Kind {
  Format format;
  Data data;
  std::uint64_t seed;
};

class Raa38ModbusExchange : public ::testing::TestWithParam<Kind> {};

TEST_P(Raa38ModbusExchange, QuarterOfAMillionWithDamagedReplies) {
  const sim::FaultRates rates = damaged_replies(0.1);
  Campaign campaign(GetParam().format, GetParam().data, GetParam().seed, rates);
  campaign.run(exchanges_per_seed);
  expect_every_fault(campaign, rates);
  EXPECT_EQ(campaign.undetectable(), 0u);
  for (const Violation& violation : campaign.encoder().violations()) {
    ADD_FAILURE() << violation.rule << " at " << violation.at.count() << " ns";
  }
}

INSTANTIATE_TEST_SUITE_P(Forms, Raa38ModbusExchange,
                         ::testing::Values(Kind{{.bits = 14}, Data::four_bytes, 1},
                                           Kind{{.bits = 21}, Data::four_bytes, 2},
                                           Kind{{.bits = 21}, Data::three_as_four, 3},
                                           Kind{{.bits = 17}, Data::three_bytes, 4}));

// What the encoder hears is not what the host sent, so it may see rules broken that the host did not break: rarely.
TEST(Raa38ModbusExchangeBothWays, QuarterOfAMillionWithDamagedRequestsToo) {
  sim::FaultRates rates = damaged_replies(0.1);
  rates[FaultKind::request_corrupt] = 0.02;
  Campaign campaign({.bits = 21}, Data::four_bytes, 5, rates);
  campaign.run(exchanges_per_seed);
  expect_every_fault(campaign, rates);
  EXPECT_EQ(campaign.undetectable(), 0u);
  EXPECT_LT(campaign.encoder().violation_count(), campaign.faulty().count(FaultKind::request_corrupt) / 200);
}

}  // namespace
}  // namespace absenc::raa38::rtu
