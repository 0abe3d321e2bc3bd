// SPDX-License-Identifier: Apache-2.0
// Tests of SafetyMonitor, and a campaign of faults against it.
#include "absenc/protocol/esl/safety.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <deque>
#include <string>
#include <type_traits>

#include "absenc/host/guarded_host_test.hpp"
#include "absenc/protocol/esl/bench_test.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::esl {
namespace {

using testing::Wire;

/// Faults inside the encoder: indexes of conditions with their values.
using Faults = std::vector<std::pair<condition::Index, std::int64_t>>;

static_assert(!std::is_default_constructible_v<SafePosition>);
static_assert(!std::is_constructible_v<SafePosition, const Reply&, Time>);
static_assert(!std::is_constructible_v<SafePosition, Reading>);

void print(const char* kind, unsigned tried, unsigned accepted) {
  std::printf("%-58s %7u tried %6u accepted\n", kind, tried, accepted);
}

/// A virtual encoder with its SafetyMonitor and without a line; the shaft stays where the test puts it.
class Monitored {
 public:
  explicit Monitored(const Profile& profile = {}) : profile_(profile), encoder(profile, shaft), monitor(profile) {
    encoder.power_on(Time{}, testing::PowerOn::skip);
    shaft.put(1, 0x123456);
  }
  Wire reply_to(DataId id) {
    now_ += 100us;
    const RequestBytes request = encode_request(profile_, {id, profile_.address});
    encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now_, .items = request});
    const Step<std::uint8_t> step = encoder.next(now_);
    Wire bytes(step.out.begin(), step.out.end());
    encoder.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now_ + 20us});
    return bytes;
  }
  void set(const Faults& faults) {
    for (const auto& [index, value] : faults) encoder.set_condition(index, value, now_);
  }
  void heal() {
    for (std::size_t i = 0; i < conditions.size(); ++i) encoder.set_condition(i, conditions[i].normal, now_);
  }
  SafetyVerdict judge(DataId id, Bytes bytes) { return monitor.judge({id, profile_.address}, bytes, now_); }
  SafetyVerdict ask(DataId id) { return judge(id, reply_to(id)); }
  SafetyVerdict next() { return ask(monitor.next_id()); }
  void trust() {
    while (next().failed != Check::passed) {
    }
  }

 private:
  Profile profile_;
  Time now_{};

 public:
  testing::TestShaft shaft;
  VirtualEncoder encoder;
  SafetyMonitor monitor;
};

TEST(EslSafety, TheSecondGoodReplyToTheOtherIdIsSafe) {
  Monitored pair;
  for (unsigned i = 0; i < 5; ++i) EXPECT_EQ(pair.ask(DataId::position).failed, Check::sequence_unknown);
  const SafetyVerdict verdict = pair.next();
  ASSERT_EQ(verdict.failed, Check::passed);
  EXPECT_EQ(verdict.position->singleturn(), 0x123456u);
  for (unsigned i = 0; i < 1000; ++i) EXPECT_TRUE(pair.ask(DataId::position).position.has_value());
  EXPECT_EQ(pair.ask(DataId::zero).failed, Check::not_a_safety_reply);
  EXPECT_EQ(pair.ask(DataId::singleturn_short).failed, Check::not_a_safety_reply);
}

TEST(EslSafety, EveryCheckHasAName) {
  struct Row {
    Faults faults;
    Check failed;
  };
  for (const Row& row : {
           Row{{{condition::ch1_status_clear, status::ready}}, Check::ch1_not_ready},
           Row{{{condition::ch2_status_clear, status::ready}}, Check::ch2_not_ready},
           Row{{{condition::ch1_status_set, status::safety_error}}, Check::safety_error},
           Row{{{condition::ch2_status_set, status::safety_error}}, Check::safety_error},
           Row{{{condition::ch1_status_set, status::parity_error}}, Check::parity_reported},
           Row{{{condition::ch2_status_set, status::stop_error}}, Check::stop_reported},
           Row{{{condition::ch1_status_set, status::channel_2}}, Check::ch1_channel_bit},
           Row{{{condition::ch2_status_clear, status::channel_2}}, Check::ch2_channel_bit},
           Row{{{condition::ch1_alarms, alarms::led_or_lissajous_error},
                {condition::ch1_status_clear, status::safety_error}},
               Check::alarm},
           Row{{{condition::ch2_alarms, alarms::memory_error}, {condition::ch2_status_clear, status::safety_error}},
               Check::alarm},
           Row{{{condition::ch1_sequence, 7}}, Check::sequences_differ},
           Row{{{condition::ch2_sequence, 7}}, Check::sequences_differ},
           Row{{{condition::redundant_offset, 2}}, Check::redundant_position},
           Row{{{condition::ch1_stuck, 0x123456 ^ 0x800000}}, Check::redundant_position},
       }) {
    Monitored pair;
    pair.trust();
    pair.set(row.faults);
    const SafetyVerdict verdict = pair.next();
    EXPECT_EQ(verdict.failed, row.failed) << text_of(verdict.failed).sentence << " / " << text_of(row.failed).sentence;
    EXPECT_FALSE(verdict.position.has_value());
    // After an error, one valid reply does not yet give a safe position.
    pair.heal();
    EXPECT_EQ(pair.next().failed, Check::sequence_unknown);
    EXPECT_EQ(pair.next().failed, Check::passed);
  }
}

TEST(EslSafety, TheForcedTestCanBeRequired) {
  Monitored pair({.require_forced_test = true});
  EXPECT_EQ(pair.next().failed, Check::forced_test_missing);
  pair.set({{condition::forced_test, 1}});
  pair.trust();
  EXPECT_EQ(pair.next().failed, Check::passed);
}

TEST(EslSafety, OtherRepliesAreCountedAsTheProfileSays) {
  for (const SequenceStep step : {SequenceStep::change, SequenceStep::safety, SequenceStep::request}) {
    Monitored pair({.sequence_step = step});
    pair.trust();
    for (const DataId other : {DataId::temperature, DataId::zero, DataId::encoder_id, DataId::alarms}) {
      pair.reply_to(other);
      pair.monitor.other_exchange(other);
      EXPECT_EQ(pair.next().failed, Check::passed) << static_cast<int>(step) << " " << static_cast<int>(other);
    }
    pair.reply_to(DataId::position);  // the encoder sends a reply here that the host does not receive
    EXPECT_EQ(pair.next().failed, step == SequenceStep::change ? Check::passed : Check::sequence_jumped);
  }
  EXPECT_EQ(Monitored().judge(DataId::singleturn_short, {}).failed, Check::length);
}

// ---- The campaign

// Returns the number of replies that the monitor accepts under a faulty condition; raises `off` to the largest error of
// their positions, in counts.
unsigned accepted_with(condition::Index index, std::int64_t value, unsigned exchanges, std::int64_t& off) {
  Monitored pair;
  pair.trust();
  pair.set({{index, value}});
  unsigned accepted = 0;
  for (unsigned i = 0; i < exchanges; ++i) {
    const SafetyVerdict verdict = pair.next();
    if (!verdict.position) continue;
    ++accepted;
    off = std::max(off, std::abs(wrapped_difference(verdict.position->singleturn(), 0x123456, 24)));
  }
  return accepted;
}

TEST(EslSafetyCampaign, StuckCountersAndPositionsOfOneChannel) {
  constexpr unsigned each = 600;  // number of exchanges for each fault; the sequence counters wrap within them
  for (const bool second : {false, true}) {
    const auto of_it = [second](condition::Index first) {
      return static_cast<condition::Index>(first + (second ? 1 : 0));
    };
    std::printf("channel %d:\n", second ? 2 : 1);
    std::int64_t off = 0;
    unsigned accepted = 0;
    for (unsigned value = 0; value < 256; value += 17)
      accepted += accepted_with(of_it(condition::ch1_sequence), value, each, off);
    print("stuck sequence counter", 16 * each, accepted);
    EXPECT_EQ(accepted, 0u);
    unsigned tried = 0;
    unsigned near = 0;
    off = 0;
    // The position at which the channel stands still takes values in steps of 0x4001 counts, so that each value of its
    // top 9 bits occurs twice.
    for (std::uint32_t stuck = 0; stuck < 0x1000000; stuck += 0x4001, ++tried) {
      const bool is_near = std::abs(wrapped_difference(stuck >> 15, 0x123456 >> 15, 9)) <= 1;
      (is_near ? near : accepted) += accepted_with(of_it(condition::ch1_stuck), stuck, 4, off);
    }
    print("stuck position, 2/512 turn off or more", tried, accepted);
    std::printf("%-58s %7s       %6u accepted, off by up to %lld counts\n", "stuck position, nearer (cannot be seen)",
                "", near, static_cast<long long>(off));
    EXPECT_EQ(accepted, 0u);
    EXPECT_LE(off, 2 * (1 << 15));
  }
  std::int64_t off = 0;
  unsigned accepted = 0;
  for (std::uint32_t offset = 2; offset < 511; ++offset) {
    accepted += accepted_with(condition::redundant_offset, offset, 4, off);
  }
  print("wrong RS", 509 * 4, accepted);
  EXPECT_EQ(accepted, 0u);
}

// A byte of a reply to data ID 1; `seen` is the mask of the bits that the checks detect when they are stuck.
struct StuckField {
  const char* name;
  std::size_t byte;
  unsigned seen;
};
constexpr unsigned seen_status =
    status::parity_error | status::stop_error | status::safety_error | status::channel_2 | status::ready;
constexpr std::array<StuckField, 14> stuck_fields{{
    {"CF1", 0, 0xFF},
    {"SF1", 1, seen_status},
    {"ALM1", 2, alarms::unsafe},
    {"ABS0", 3, 0},  // ABS0 is undetected, because its bits are below the resolution of channel 2
    {"ABS1", 4, 0},  // ABS1 is undetected: its bits are below the resolution of channel 2 or within the tolerance
    {"ABS2", 5, 0xFF},
    {"ABM0", 6, 0},  // a stuck turn counter is undetected, because a safe position has no turns
    {"ABM1", 7, 0},
    {"SC1", 8, 0x7F},  // the top bit of SC1 is undetected, because SC2 has seven bits
    {"CF2", 11, 0xFF},
    {"SF2", 12, seen_status},
    {"ALM2", 13, alarms::unsafe},
    {"RS0", 14, 0xFF},
    {"RS1, SC2", 15, 0x7F},  // the bit RS1 is undetected, because it is within the tolerance
}};

// Returns the reply with one bit set to `value`; the CRC of its channel is made right again.
Wire stuck(Wire reply, std::size_t byte, unsigned bit, bool value) {
  const auto mask = static_cast<std::uint8_t>(1u << bit);
  reply[byte] = static_cast<std::uint8_t>(value ? reply[byte] | mask : reply[byte] & ~mask);
  const bool first = byte < 11;
  const std::size_t begin = first ? 0 : 11;
  const std::size_t end = first ? 9 : 16;
  const std::uint16_t crc =
      checksum16(CrcBitOrder::lsb, first ? Channel::one : Channel::two, Bytes(reply).subspan(begin, end - begin));
  reply[end] = static_cast<std::uint8_t>(crc);
  reply[end + 1] = static_cast<std::uint8_t>(crc >> 8);
  return reply;
}

// Counts how many replies with one stuck bit the monitor accepts.
TEST(EslSafetyCampaign, EveryBitOfEveryFieldStuckAt0AndAt1) {
  sim::Random random(7);
  for (const StuckField& field : stuck_fields) {
    unsigned changed = 0;
    unsigned seen = 0;
    unsigned unseen = 0;
    for (unsigned bit = 0; bit < 8; ++bit) {
      const bool visible = (field.seen >> bit & 1) != 0;
      for (const bool value : {false, true}) {
        Monitored pair;
        for (unsigned i = 0; i < 300; ++i) {
          pair.encoder.lower_alarms(0xFF);
          pair.shaft.put(static_cast<std::int64_t>(random.below(65536)),
                         static_cast<std::int64_t>(random.below(1 << 24)));
          pair.trust();
          const bool alarmed = i % 2 == 1;
          if (alarmed) pair.encoder.raise_alarms(1u << random.below(8));
          const Wire good = pair.reply_to(DataId::position);
          const Wire bad = stuck(good, field.byte, bit, value);
          if (bad == good) continue;
          ++changed;
          if (!pair.judge(DataId::position, bad).position) continue;
          ++(visible ? seen : unseen);
        }
      }
    }
    print((std::string(field.name) + " stuck, bits that the checks see").c_str(), changed, seen);
    if (field.seen != 0xFF) std::printf("%-58s %7s       %6u accepted\n", "  bits that cannot be seen", "", unseen);
    EXPECT_GT(changed, 0u);
    EXPECT_EQ(seen, 0u) << field.name;
    EXPECT_EQ(unseen > 0, field.seen != 0xFF) << field.name;
  }
}

TEST(EslSafetyCampaign, SmallErrorsAndSwapsOfAnId1Reply) {
  Monitored pair;
  pair.trust();
  const SafetyMonitor trusting = pair.monitor;
  const Wire good = pair.reply_to(DataId::position);
  ASSERT_TRUE(SafetyMonitor(trusting).judge({}, good, {}).position.has_value());
  const auto accepted = [&trusting](Bytes bytes) {
    return SafetyMonitor(trusting).judge({}, bytes, {}).position.has_value() ? 1u : 0u;
  };
  unsigned pairs = 0;
  unsigned wrong = 0;
  for (unsigned a = 0; a < 144; ++a) {
    for (unsigned b = a; b < 144; ++b, ++pairs) {
      Wire bad = good;
      bad[a / 8] ^= static_cast<std::uint8_t>(1u << a % 8);
      if (b != a) bad[b / 8] ^= static_cast<std::uint8_t>(1u << b % 8);
      wrong += accepted(bad);
    }
  }
  print("1- and 2-bit errors", pairs, wrong);
  EXPECT_EQ(pairs, 144u + 10'296u);
  EXPECT_EQ(wrong, 0u);

  unsigned swaps = 0;
  unsigned swapped = 0;
  for (unsigned i = 0; i < 200; ++i) {
    pair.shaft.put(i, std::int64_t{i} * 83'617);
    pair.trust();
    const SafetyMonitor then = pair.monitor;
    const Wire reply = pair.reply_to(DataId::position);
    for (std::size_t a = 0; a < reply.size(); ++a) {
      for (std::size_t b = a + 1; b < reply.size(); ++b) {
        if (reply[a] == reply[b]) continue;
        Wire bad = reply;
        std::swap(bad[a], bad[b]);
        ++swaps;
        swapped += SafetyMonitor(then).judge({}, bad, {}).position.has_value() ? 1u : 0u;
      }
    }
  }
  print("swaps of two bytes", swaps, swapped);
  EXPECT_GT(swaps, 10'000u);
  EXPECT_EQ(swapped, 0u);

  unsigned cut = 0;
  for (std::size_t size = 0; size < good.size(); ++size) cut += accepted(Bytes(good).first(size));
  print("cut short", 18, cut);
  EXPECT_EQ(cut, 0u);
}

TEST(EslSafetyCampaign, ReplaysAndDelays) {
  for (const SequenceStep step : {SequenceStep::change, SequenceStep::safety}) {
    std::printf("sequence_step=%s:\n", step == SequenceStep::change ? "change" : "safety");
    Monitored pair({.sequence_step = step});
    unsigned again = 0;
    for (unsigned i = 0; i < 1000; ++i) {
      pair.trust();
      const Wire last = pair.reply_to(DataId::position);
      pair.judge(DataId::position, last);
      for (unsigned times = 0; times < 4; ++times) {
        again += pair.judge(pair.monitor.next_id(), last).position.has_value() ? 1u : 0u;
      }
    }
    print("the last reply again", 4000, again);
    EXPECT_EQ(again, 0u);

    unsigned older = 0;
    std::deque<Wire> past;
    pair.trust();
    for (unsigned i = 0; i < 1000; ++i) {
      past.push_back(pair.reply_to(DataId::position));
      pair.judge(DataId::position, past.back());
      if (past.size() < 11) continue;
      SafetyMonitor monitor = pair.monitor;
      older += monitor.judge({}, past[i % 9], {}).position.has_value() ? 1u : 0u;
      past.pop_front();
    }
    print(step == SequenceStep::change ? "an older reply once (cannot be seen)" : "an older reply once", 990, older);
    EXPECT_EQ(older, step == SequenceStep::change ? 990u : 0u);

    // Here the host gets every reply one cycle late, so it gets no reply in the first cycle.
    unsigned late = 0;
    pair.trust();
    Wire held = pair.reply_to(pair.monitor.next_id());
    pair.monitor.missed({pair.monitor.next_id()});
    for (unsigned i = 0; i < 1000; ++i) {
      const DataId id = pair.monitor.next_id();
      const Wire now = pair.reply_to(id);
      late += pair.judge(id, held).position.has_value() ? 1u : 0u;
      held = now;
    }
    print("every reply one cycle late", 1000, late);
    EXPECT_EQ(late, 0u);
  }
}

// Random bytes pass the CRCs of both channels about once in 2^32 times.
TEST(EslSafetyCampaign, NoiseOfTheRightLength) {
  sim::Random random(1);
  Monitored pair;
  pair.trust();
  const SafetyMonitor trusting = pair.monitor;
  unsigned accepted = 0;
  for (unsigned i = 0; i < 200'000; ++i) {
    Wire noise(18);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random.next());
    noise[0] = noise[11] = control_field({}, 0, DataId::position);
    accepted += SafetyMonitor(trusting).judge({}, noise, {}).position.has_value() ? 1u : 0u;
  }
  print("noise with the right control fields", 200'000, accepted);
  EXPECT_EQ(accepted, 0u);
}

TEST(EslSafetyCampaign, SafePositionsOverABadLine) {
  const sim::FaultRates rates = sim::testing::damaged_replies(0.1);
  sim::Random random(1);
  testing::TestShaft shaft;
  VirtualEncoder encoder({}, shaft);
  encoder.power_on(Time{}, testing::PowerOn::skip);
  sim::FaultyDevice faulty(encoder, rates, 1);
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  line.attach(sim::NodeRole::device, faulty);
  host::testing::GuardedHost<std::uint8_t> host(unit, line);
  unsigned safe = 0;
  while (encoder.answer_count() < 50'000) {
    shaft.put(static_cast<std::int64_t>(random.below(65536)), static_cast<std::int64_t>(random.below(1 << 24)));
    if (random.chance(0.05)) encoder.raise_alarms(1u << random.below(8));
    if (random.chance(0.05)) encoder.lower_alarms(0xFF);
    const testing::Talk read(unit, testing::options_of({}), "safe-position");
    ASSERT_TRUE(host.run((*read), 10s)) << "hangs";
    if ((*read).error() != Error::none) continue;
    ++safe;
    const Reply truth = encoder.reply_to(DataId::position, line.now());
    ASSERT_NE((*read).reading(), nullptr);
    ASSERT_EQ((*read).reading()->singleturn, truth.singleturn);
    ASSERT_EQ(truth.one.alarms & alarms::unsafe, 0);
  }
  print("safe positions over a bad line", 50'000, safe);
  EXPECT_GT(safe, 5'000u);
  EXPECT_EQ(encoder.violation_count(), 0u);
}

}  // namespace
}  // namespace absenc::esl
