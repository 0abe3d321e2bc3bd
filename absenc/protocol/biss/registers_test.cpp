// SPDX-License-Identifier: Apache-2.0
// Tests of positions and registers that are read from the same frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <set>
#include <vector>

#include "absenc/protocol/biss/procedure_bench_test.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/motion.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::biss {
namespace {

using testing::bits_24;
using testing::ProcedureBench;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool slow = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
constexpr bool slow = true;
#else
constexpr bool slow = false;
#endif
#else
constexpr bool slow = false;
#endif
constexpr std::uint32_t some = 20'000;
constexpr std::uint32_t a_million = slow ? 50'000 : 1'000'000;

std::uint32_t frames_wanted(std::uint32_t usual = some) {
  const char* const text = std::getenv("ABSENC_FRAMES");
  return text == nullptr ? usual : static_cast<std::uint32_t>(std::atoll(text));
}

// Number of frames after which the next host ends; a global variable, because a procedure starts in a constructor.
std::uint32_t limit = 0;

/// Counters of a host's register accesses, and the register values that the host relies on.
struct HostRecord {
  std::uint32_t frames = limit;
  std::uint32_t reads = 0;
  std::uint32_t writes = 0;
  std::uint32_t failures = 0;
  std::uint32_t wrong = 0;  // number of register values that the host read without an error although they were wrong
  std::array<bool, registers::bank_size> read{};
  std::array<bool, registers::bank_size> written{};
  std::array<std::uint8_t, registers::bank_size> known{};
  std::array<bool, registers::bank_size> is_known{};
  Reading reading{};
};

template <class F>
Procedure work_on_a_bank(ControlDialog<F>& dialog, HostRecord& record) {
  ControlMaster master;
  auto& known = record.known;
  auto& is_known = record.is_known;
  std::uint32_t seed = 1;
  while (dialog.frames() < record.frames) {
    for (unsigned address = 0; address < registers::bank_size; ++address) {
      ByteBuffer<control_most> bytes;
      seed = seed * 1'664'525 + 1'013'904'223;
      const std::size_t count = 1 + (seed >> 24) % 3;
      const std::size_t fits = std::min<std::size_t>(count, registers::bank_size - address);
      const Error error = co_await read_registers(dialog, master, bytes, address, fits);
      ++record.reads;
      if (error != Error::none) ++record.failures;
      for (std::size_t i = 0; i < bytes.size(); ++i) {
        if (is_known[address + i] && bytes[i] != known[address + i]) ++record.wrong;
        record.read[address + i] = true;
      }
      const auto value = static_cast<std::uint8_t>(seed >> 16);
      const Error written = co_await write_register(dialog, master, address, value);
      ++record.writes;
      if (written != Error::none) ++record.failures;
      // after a failed write the host does not know the value of the register
      is_known[address] = written == Error::none;
      known[address] = value;
      record.written[address] = record.written[address] || is_known[address];
    }
  }
  co_return done;
}

/// A host together with the storage of its coroutines.
template <class F>
struct Host {
  struct Machine final : author::Run<ProtocolOf<F>, HostRecord, work_on_a_bank<F>> {
    using author::Run<ProtocolOf<F>, HostRecord, work_on_a_bank<F>>::Run;
    void report(FieldSink&) const override {}
  };
  Host(const F& format, std::uint32_t frames) : storage((limit = frames, 4096)), machine(format, {}, storage) {}
  std::vector<std::byte> storage;
  Machine machine;
};

/// Passes the position of each valid frame of a conversation to `compare`.
template <class Conversation, class Compare>
struct Watched final : absenc::Machine<std::uint8_t> {
  Watched(Conversation& one, const Compare& with) : conversation(one), compare(with) {}
  void feed(const Event<std::uint8_t>& event) override {
    conversation.feed(event);
    if (event.kind != Event<std::uint8_t>::Kind::received) return;
    if (const Reading reading = conversation.carried(); reading.singleturn_bits != 0) compare(reading);
  }
  Step<std::uint8_t> next(Time now) override { return conversation.next(now); }

  Conversation& conversation;
  Compare compare;
};

struct Outcome {
  std::uint64_t positions = 0;
  std::uint64_t wrong = 0;
  std::uint64_t gaps = 0;  // number of frames that did not begin exactly one timeout after the previous frame
  std::uint64_t damaged = 0;
  sim::FaultCounts faults{};
  // number of registers whose value differs from the one that the host believes to have written
  std::uint32_t wrong_bytes = 0;
  std::uint32_t frames = 0;
  std::uint32_t bad_frames = 0;
  std::size_t violations = 0;
};

template <class F>
Outcome run(Host<F>& host, const F& format, const sim::FaultRates& rates) {
  const sim::Motion motion = sim::Motion::constant_speed(0, 600);
  VirtualEncoderOf<F> encoder(format, motion);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  sim::FaultyDevice faulty(encoder, rates, 7);
  sim::Line<std::uint8_t> line(LinkKind::clocked, line_settings);
  line.attach(sim::NodeRole::device, faulty);
  Outcome outcome;
  const auto compare = [&](const Reading& reading) {
    const Word truth = word_of(WordFormat(format.word), motion.at(reading.latched), 0);
    ++outcome.positions;
    if (reading.singleturn_valid() && reading.singleturn != truth.position) ++outcome.wrong;
  };
  Time last_end = -1s;
  line.observe_transfers([&](const sim::Line<std::uint8_t>::Transfer& seen) {
    if (last_end >= Time{} && seen.start != last_end + timeout_maximum) ++outcome.gaps;
    last_end = seen.end;
  });
  Watched<decltype(host.machine), decltype(compare)> watched(host.machine, compare);
  const auto node = line.attach(sim::NodeRole::host, watched);
  EXPECT_TRUE(line.run(node, std::chrono::hours(24)));
  outcome.damaged = faulty.damaged_replies();
  outcome.faults = faulty.counts();
  const HostRecord& record = host.machine.found();
  for (unsigned address = 0; address < registers::bank_size; ++address) {
    if (record.is_known[address] && encoder.memory()[address] != record.known[address]) ++outcome.wrong_bytes;
  }
  outcome.frames = host.machine.frames();
  outcome.bad_frames = host.machine.bad_frames();
  outcome.violations = encoder.violation_count();
  return outcome;
}

void expect_all_of_the_bank(const HostRecord& record) {
  for (unsigned address = 0; address < registers::bank_size; ++address) {
    EXPECT_TRUE(record.read[address]) << address;
    EXPECT_TRUE(record.written[address]) << address;
  }
}

/// Returns the share of damaged frames that give a wrong position without an error.
template <class Damage>
double accepted_share(const Format& format, const Damage& damage) {
  constexpr unsigned frames = 400'000;
  sim::Random random(5);
  unsigned taken = 0;
  for (unsigned i = 0; i < frames; ++i) {
    Reply reply;
    reply.ack_bits = ack_bits(Behaviour{}.latency, format.period());
    reply.word.position = random.next() & low_mask(format.word.bits_of(Meaning::position));
    BitBuffer<64> sent;
    EXPECT_TRUE(encode(format, reply, sent));
    const std::size_t clocks = sent.size();
    std::array<std::uint8_t, 8> bytes{};
    std::copy(sent.bytes().begin(), sent.bytes().end(), bytes.begin());
    damage(random, std::span(bytes).first((clocks + 7) / 8));
    const Result<Reply> seen = decode(format, {bytes, clocks}, Cds::any);
    if (seen && !seen->word.error && seen->word.position != reply.word.position) ++taken;
  }
  return static_cast<double>(taken) / frames;
}

// Damages frames as sim::FaultyDevice does.
void corrupt(sim::Random& random, std::span<std::uint8_t> bytes) {
  std::set<std::uint64_t> bits;
  for (const std::uint64_t count = 1 + random.below(3); bits.size() < count;)
    bits.insert(random.below(bytes.size() * 8));
  for (const std::uint64_t bit : bits) bytes[bit / 8] ^= static_cast<std::uint8_t>(0x80u >> bit % 8);
}
void truncate(sim::Random& random, std::span<std::uint8_t> bytes) {
  std::ranges::fill(bytes.subspan(1 + random.below(bytes.size() - 1)), std::uint8_t{0xFF});
}

TEST(BissRegisters, ReadsEveryPositionDuringRegisterAccess) {
  const Format format = bits_24;
  Host<Format> host(format, frames_wanted());
  const Outcome seen = run(host, format, {});
  const HostRecord& record = host.machine.found();
  EXPECT_EQ(host.machine.error(), Error::none);
  EXPECT_GE(seen.frames, frames_wanted());
  EXPECT_EQ(seen.positions, seen.frames);  // each frame gave a position
  EXPECT_EQ(seen.wrong, 0u);
  EXPECT_EQ(seen.gaps, 0u);
  EXPECT_EQ(seen.violations, 0u);
  EXPECT_EQ(record.failures, 0u);
  EXPECT_EQ(record.wrong, 0u);
  EXPECT_EQ(seen.wrong_bytes, 0u);
  expect_all_of_the_bank(record);
}

TEST(BissRegisters, FaultsCauseNoWrongRegisterByte) {
  const Format format = bits_24;
  sim::FaultRates rates;
  rates[sim::FaultKind::corrupt] = 0.004;
  rates[sim::FaultKind::truncate] = 0.001;
  rates[sim::FaultKind::silence] = 0.001;
  Host<Format> host(format, frames_wanted(a_million));
  const Outcome seen = run(host, format, rates);
  const HostRecord& record = host.machine.found();
  EXPECT_GT(seen.damaged, seen.frames / 500);
  EXPECT_EQ(seen.positions + seen.bad_frames, seen.frames);
  EXPECT_LE(seen.bad_frames, seen.damaged);  // the host rejected at most as many frames as were damaged
  EXPECT_EQ(seen.gaps, 0u);
  const auto times = [&seen](sim::FaultKind kind) {
    return static_cast<double>(seen.faults[static_cast<std::size_t>(kind)]);
  };
  const double computed = times(sim::FaultKind::corrupt) * accepted_share(format, corrupt) +
                          times(sim::FaultKind::truncate) * accepted_share(format, truncate);
  std::printf("%u frames, %llu damaged: %llu wrong positions, %.3g computed\n", seen.frames,
              static_cast<unsigned long long>(seen.damaged), static_cast<unsigned long long>(seen.wrong), computed);
  EXPECT_LE(static_cast<double>(seen.wrong), computed + 5 * std::sqrt(computed));
  EXPECT_EQ(record.wrong, 0u);
  EXPECT_EQ(seen.wrong_bytes, 0u);
  // Some accesses fail, because a write is never repeated.
  EXPECT_LT(record.failures, (record.reads + record.writes) / 4);
  expect_all_of_the_bank(record);
}

TEST(BissRegisters, AcceptsNoDamagedFrameWithLifeCounter) {
  Format format = bits_24;
  format.check = crc16;
  sim::FaultRates rates;
  rates[sim::FaultKind::corrupt] = 0.01;
  Host<Format> host(format, frames_wanted() / 4);
  const Outcome seen = run(host, format, rates);
  EXPECT_GT(seen.bad_frames, 0u);
  EXPECT_EQ(seen.wrong, 0u);
  EXPECT_EQ(host.machine.found().wrong, 0u);
}

TEST(BissRegisters, ReadsEachNamedRegister) {
  ProcedureBench one;
  EXPECT_EQ((one.ask<read_setting<Format>, registers::eds_bank>().eds_bank), 0);
  EXPECT_EQ((one.ask<read_setting<Format>, registers::profile>().profile), 0);
  EXPECT_EQ((one.ask<read_setting<Format>, registers::serial_number>().serial_number), 1u);
  EXPECT_EQ((one.ask<read_setting<Format>, registers::device_id>().device_id.size()), 6u);
  EXPECT_EQ((one.ask<read_setting<Format>, registers::manufacturer>().manufacturer.view()), "ve");
  EXPECT_EQ((one.ask<read_setting<Format>, registers::bank_select>().bank), 0);
  one.ask<write_bank<Format>>({200});
  const ControlResults found = one.ask<read_setting<Format>, registers::bank_select>();
  EXPECT_EQ(found.bank, 200);
  EXPECT_FALSE(found.missing);
}

// A refused register is reported as missing; a register of a slave that does not answer is not.
TEST(BissRegisters, ReportsRefusedRegisterAsMissing) {
  ProcedureBench one;
  one.ask<write_bank<Format>>({200});
  const ControlResults found = one.ask<read_setting<Format>, 0u>();
  EXPECT_EQ(found.missing, true);
  EXPECT_EQ(found.slave_id, 0);
  one.format.slave = 3;
  EXPECT_FALSE((one.ask<read_setting<Format>, registers::profile>({}, Error::timeout).missing));
}

TEST(BissRegisters, SendsStartSequenceBeforeRegisterAccess) {
  Format format = bits_24;
  format.start_sequence = true;
  ProcedureBench waiting(format);
  EXPECT_EQ(waiting.ask<read_info<Format>>().serial_number, 1u);
  EXPECT_EQ(waiting.encoder.violation_count(), 0u);
  ProcedureBench off;
  off.encoder.power_off(Time{});
  off.ask<read_info<Format>>({}, Error::line_stuck);
}

TEST(BissRegisters, UsesByteOrderOfFormat) {
  for (const RegisterOrder encoders : {RegisterOrder::big, RegisterOrder::little}) {
    for (const RegisterOrder hosts : {RegisterOrder::big, RegisterOrder::little}) {
      Format of_encoder = bits_24;
      of_encoder.register_order = encoders;
      Format of_host = bits_24;
      of_host.register_order = hosts;
      const sim::Motion motion = sim::Motion::constant_speed(0, 600);
      VirtualEncoder encoder(of_encoder, motion);
      encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
      std::vector<std::byte> storage(4096);
      testing::ProcedureRun<read_info<Format>> asked(of_host, {}, storage);
      sim::Line<std::uint8_t> line(LinkKind::clocked, line_settings);
      line.attach(sim::NodeRole::device, encoder);
      EXPECT_TRUE(line.run(line.attach(sim::NodeRole::host, asked), 10s));
      ASSERT_EQ(asked.error(), Error::none);
      EXPECT_EQ(asked.found().serial_number, encoders == hosts ? 1u : 0x0100'0000u);
    }
  }
}

TEST(BissRegisters, WaitsForSlowRegisters) {
  Format format = bits_24;
  format.register_delay_us = 15'000;
  Host<Format> host(format, 1'000);
  const Outcome seen = run(host, format, {});
  EXPECT_EQ(host.machine.found().failures, 0u);
  EXPECT_EQ(host.machine.found().wrong, 0u);
  EXPECT_EQ(seen.positions, seen.frames);
}

}  // namespace
}  // namespace absenc::biss
