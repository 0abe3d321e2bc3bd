// SPDX-License-Identifier: Apache-2.0
// A host that reads positions and registers from the same frames against a virtual encoder in virtual time, with
// faults, and without. ABSENC_FRAMES sets how many frames go by.
#include <gtest/gtest.h>

#include <cmath>

#include <cstdlib>
#include <memory>
#include <vector>

#include "absenc/protocol/biss/commands.hpp"
#include "absenc/protocol/biss/device.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/line.hpp"
#include "absenc/sim/motion.hpp"

namespace absenc::biss {
namespace {

std::uint32_t frames_wanted() {
  const char* const text = std::getenv("ABSENC_FRAMES");
  return text == nullptr ? 20'000 : static_cast<std::uint32_t>(std::atoll(text));
}

std::uint32_t limit = 0;  // of frames, for the next host: it begins when it is made

/// What a host did, and what it believed.
struct Work {
  std::uint32_t frames = limit;
  std::uint32_t reads = 0;
  std::uint32_t writes = 0;
  std::uint32_t failures = 0;
  std::uint32_t wrong = 0;  // bytes that were taken for good
  std::array<bool, registers::bank_size> read{};
  std::array<bool, registers::bank_size> written{};
  Reading reading{};
};

template <class F>
Procedure work_on_a_bank(ControlDialog<F>& dialog, Work& work) {
  dialog.emit_positions();
  ControlMaster master;
  std::array<std::uint8_t, registers::bank_size> known{};
  std::array<bool, registers::bank_size> is_known{};
  std::uint32_t seed = 1;
  while (dialog.frames() < work.frames) {
    for (unsigned address = 0; address < registers::bank_size; ++address) {
      ByteBuffer<control_most> bytes;
      seed = seed * 1'664'525 + 1'013'904'223;
      const std::size_t count = 1 + (seed >> 24) % 3;
      const std::size_t fits = std::min<std::size_t>(count, registers::bank_size - address);
      const Error error = co_await read_registers(dialog, master, bytes, address, fits);
      ++work.reads;
      if (error != Error::none) ++work.failures;
      for (std::size_t i = 0; i < bytes.size(); ++i) {
        if (is_known[address + i] && bytes[i] != known[address + i]) ++work.wrong;
        work.read[address + i] = true;
      }
      const auto value = static_cast<std::uint8_t>(seed >> 16);
      const Error written = co_await write_register(dialog, master, address, value);
      ++work.writes;
      if (written != Error::none) ++work.failures;
      is_known[address] = written == Error::none;  // else nobody knows
      known[address] = value;
      work.written[address] = work.written[address] || is_known[address];
    }
  }
  co_return done;
}

/// The host with its storage.
template <class F>
struct Host {
  struct Machine final : author::Run<ProtocolOf<F>, Work, work_on_a_bank<F>> {
    using author::Run<ProtocolOf<F>, Work, work_on_a_bank<F>>::Run;
    void report(FieldSink&) const override {}
  };
  Host(const F& format, std::uint32_t frames) : storage((limit = frames, 4096)), machine(format, {}, storage) {}
  std::vector<std::byte> storage;
  Machine machine;
};

struct Outcome {
  std::uint64_t positions = 0;
  std::uint64_t wrong = 0;
  std::uint64_t gaps = 0;  // a frame began later than the one before lets it
  std::uint64_t damaged = 0;
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
  line.attach(sim::Role::device, faulty);
  Outcome outcome;
  const auto on_emit = [&] {
    const Reading& reading = host.machine.position();
    const Word truth = word_of(WordFormat(format.word), motion.at(reading.latched), 0);
    ++outcome.positions;
    if (reading.singleturn != truth.position) ++outcome.wrong;
    return true;
  };
  Time last_end = -1s;
  line.observe_transfers([&](const sim::Line<std::uint8_t>::Transfer& seen) {
    if (last_end >= Time{} && seen.start != last_end + timeout_maximum) ++outcome.gaps;
    last_end = seen.end;
  });
  const auto node = line.attach(sim::Role::host, host.machine, on_emit);
  EXPECT_TRUE(line.run(node, std::chrono::hours(24)));
  outcome.damaged = faulty.damaged_replies();
  outcome.frames = host.machine.frames();
  outcome.bad_frames = host.machine.bad_frames();
  outcome.violations = encoder.violation_count();
  return outcome;
}

void expect_all_of_the_bank(const Work& work) {
  for (unsigned address = 0; address < registers::bank_size; ++address) {
    EXPECT_TRUE(work.read[address]) << address;
    EXPECT_TRUE(work.written[address]) << address;
  }
}

constexpr Format bits_24{.word = "position:24 error:1! warning:1!"_word};

TEST(BissRegisters, PositionsGoByWhileEveryRegisterIsReadAndWritten) {
  const Format format = bits_24;
  Host<Format> host(format, frames_wanted());
  const Outcome seen = run(host, format, {});
  const Work& work = host.machine.found();
  EXPECT_EQ(host.machine.error(), Error::none);
  EXPECT_GE(seen.frames, frames_wanted());
  EXPECT_EQ(seen.positions, seen.frames);  // none is missed
  EXPECT_EQ(seen.wrong, 0u);
  EXPECT_EQ(seen.gaps, 0u);
  EXPECT_EQ(seen.violations, 0u);
  EXPECT_EQ(work.failures, 0u);
  EXPECT_EQ(work.wrong, 0u);
  expect_all_of_the_bank(work);
}

TEST(BissRegisters, FaultsMakeNoWrongByte) {
  const Format format = bits_24;
  sim::FaultRates rates;
  rates[sim::FaultKind::corrupt] = 0.004;
  rates[sim::FaultKind::truncate] = 0.001;
  rates[sim::FaultKind::silence] = 0.001;
  Host<Format> host(format, frames_wanted());
  const Outcome seen = run(host, format, rates);
  const Work& work = host.machine.found();
  EXPECT_GT(seen.damaged, seen.frames / 500);
  EXPECT_EQ(seen.positions + seen.bad_frames, seen.frames);
  EXPECT_EQ(seen.gaps, 0u);
  // Of damaged frames 2^-6 are good by chance for a CRC of six bits; five standard deviations of that.
  const double by_chance = std::ldexp(static_cast<double>(seen.damaged), -6);
  EXPECT_LE(static_cast<double>(seen.wrong), by_chance + 5 * std::sqrt(by_chance));
  EXPECT_EQ(work.wrong, 0u);
  EXPECT_LT(work.failures, (work.reads + work.writes) / 4);  // a write is not repeated
  expect_all_of_the_bank(work);
}

TEST(BissRegisters, WithALifeCounterNoDamagedFrameIsAPosition) {
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

TEST(BissRegisters, AnEncoderThatIsSlowIsWaitedFor) {
  Format format = bits_24;
  format.register_delay = 15ms;
  Host<Format> host(format, 1'000);
  const Outcome seen = run(host, format, {});
  EXPECT_EQ(host.machine.found().failures, 0u);
  EXPECT_EQ(host.machine.found().wrong, 0u);
  EXPECT_EQ(seen.positions, seen.frames);
}

}  // namespace
}  // namespace absenc::biss
