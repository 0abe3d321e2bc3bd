// SPDX-License-Identifier: Apache-2.0
// Tests of the host's conversations, with the virtual encoder or given frames.
#include "absenc/protocol/biss/host.hpp"

#include <gtest/gtest.h>

#include <array>
#include <span>
#include <tuple>
#include <vector>

#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/biss/unit.hpp"

namespace absenc::biss {
namespace {

using testing::Bench;

const Format turns_19{.word = word_with_status({.position = 19, .multiturn = 16})};

TEST(BissHost, LatchesAtFirstFallingEdge) {
  Bench bench(line_settings, turns_19);
  bench.shaft.state.position = (std::int64_t{1} << 32) + (std::int64_t{275096} << 13);
  ReadPosition read(turns_19);
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(read.last().ack_bits, 10u);
  EXPECT_EQ(read.last().crc, 0x1C);
  ASSERT_NE(read.reading(), nullptr);
  EXPECT_EQ(read.reading()->latched, 40us);
  EXPECT_EQ(read.reading()->received, 40us + (2 + 10 + 2 + 43) * 1us);
  EXPECT_EQ(read.reading()->multiturn, 1u);
  EXPECT_EQ(read.reading()->singleturn, 275096u);
  EXPECT_TRUE(read.reading()->multiturn_valid);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(BissHost, PausesForTimeoutOfFormat) {
  for (const auto& [timeout, rest] : std::to_array<std::pair<Timeout, Time>>({{{}, 40us},
                                                                              {Timeout::fixed(12'500ns), 12'500ns},
                                                                              {Timeout::fixed(25us), 25us},
                                                                              {Timeout::adaptive(), 2'500ns}})) {
    Format format = turns_19;
    format.timeout = timeout;
    Bench bench(line_settings, format);
    ReadPosition read(format);
    ASSERT_EQ(bench.run(read).error(), Error::none);
    EXPECT_EQ(read.reading()->latched, rest);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST(BissHost, ClocksEnoughForAckAtEveryClock) {
  for (const std::uint16_t khz : std::to_array<std::uint16_t>({100, 1'000, 4'400, 6'000, 10'000})) {
    const Format format{.word = turns_19.word, .ma_khz = khz};
    Bench bench(line_settings, format);
    ReadPosition read(format);
    ASSERT_EQ(bench.run(read).error(), Error::none) << khz;
    EXPECT_EQ(read.last().ack_bits, ack_bits(10us, LineSettings{.rate = khz * 1000u}.bits(1)));
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST(BissHost, ErrorBitInvalidatesPosition) {
  Bench bench(line_settings, turns_19);
  for (const std::uint32_t alarms : {0u, word_error, word_warning, word_error | word_warning}) {
    bench.encoder.lower_alarms(~0u);
    bench.encoder.raise_alarms(alarms);
    ReadPosition read(turns_19);
    ASSERT_EQ(bench.run(read).error(), Error::none);
    EXPECT_EQ(read.reading()->alarms, alarms);
    EXPECT_EQ(read.reading()->singleturn_valid(), (alarms & word_error) == 0);
    EXPECT_EQ(read.reading()->multiturn_valid, (alarms & word_error) == 0);
  }
}

TEST(BissHost, ReportsLateFrameStuckLineAndImpossibleClock) {
  Bench slow(line_settings, turns_19, Behaviour{.latency = 12us});
  ReadPosition truncated(turns_19);
  EXPECT_EQ(slow.run(truncated).error(), Error::truncated);
  EXPECT_EQ(slow.encoder.violation_count(), 1u);
  FindPosition<Format> found(turns_19);
  EXPECT_EQ(slow.run(found).error(), Error::none);
  Bench slower(line_settings, turns_19, Behaviour{.latency = 100us});
  FindPosition<Format> too_late(turns_19);
  EXPECT_EQ(slower.run(too_late).error(), Error::truncated);
  EXPECT_EQ(truncated.reading(), nullptr);

  Bench off(line_settings, turns_19);
  off.encoder.power_off(Time{});
  ReadPosition stuck(turns_19);
  EXPECT_EQ(off.run(stuck).error(), Error::line_stuck);

  ReadPosition impossible({.word = turns_19.word, .ma_khz = 10'000, .latency = 1ms});
  EXPECT_EQ(impossible.next(Time{}).kind, Step<std::uint8_t>::Kind::done);
  EXPECT_EQ(impossible.error(), Error::invalid_argument);
}

TEST(BissHost, AddsClocksForLineDelay) {
  for (const Time delay : {1us, 3us, 17us, 40us}) {
    Bench bench(line_settings, turns_19, Behaviour{.latency = 30us, .line_delay = delay + 500ns});
    bench.shaft.state.position = std::int64_t{275096} << 13;
    FindPosition<Format> read(turns_19);
    ASSERT_EQ(bench.run(read).error(), Error::none) << delay.count();
    EXPECT_EQ(read.reading()->singleturn, 275096u);
    EXPECT_EQ(read.last().ack_bits, 30u);
    EXPECT_EQ(read.last().delay_bits, delay / 1us);
  }
}

// Feeds these frames to a reader, one after the other, and returns the error of the reader.
template <class Reader>
Error clock_out(Reader& read, std::span<const BitBuffer<128>> frames) {
  Time now{};
  for (Step<std::uint8_t> step = read.next(now); step.kind != Step<std::uint8_t>::Kind::done; step = read.next(now)) {
    if (step.kind != Step<std::uint8_t>::Kind::transfer) continue;
    if (frames.empty()) break;
    std::vector<std::uint8_t> bytes(frames.front().bytes().begin(), frames.front().bytes().end());
    frames = frames.subspan(1);
    bytes.resize(step.expect);
    now = step.at + 100us;
    read.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    read.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = bytes});
  }
  return read.error();
}

// Expects that the reader of a format known at compile time gives the same results as the reader of any format.
template <const Format& format>
void reads_as_any_format() {
  std::array<BitBuffer<128>, 2> good;
  for (std::uint8_t i = 0; i < good.size(); ++i) {
    Reply reply{.ack_bits = ack_bits(format.latency, format.period()), .life_counter = i};
    reply.word = word_of(format.word, {.position = 0x3'89AB'CDEFll}, 0);
    ASSERT_TRUE(encode(format, reply, good[i]));
  }
  const BitView view = good[0].view();
  for (std::size_t wrong = 0; wrong <= view.size; ++wrong) {
    BitBuffer<128> first;
    for (std::size_t i = 0; i < view.size; ++i) first.append(view[i] != (i == wrong) ? 1 : 0, 1);
    const std::array frames{first, good[1]};
    ReadPosition any(format);
    ReadKnownPosition<format> known;
    EXPECT_EQ(clock_out(known, frames), clock_out(any, frames)) << wrong;
    if (wrong == view.size) {
      EXPECT_EQ(any.error(), Error::none);
    }
    ASSERT_EQ(known.reading() != nullptr, any.reading() != nullptr) << wrong;
    if (any.reading() == nullptr) continue;
    EXPECT_EQ(known.reading()->singleturn, any.reading()->singleturn);
    EXPECT_EQ(known.reading()->multiturn, any.reading()->multiturn);
    EXPECT_EQ(known.reading()->singleturn_bits, any.reading()->singleturn_bits);
    EXPECT_EQ(known.reading()->multiturn_bits, any.reading()->multiturn_bits);
    EXPECT_EQ(known.reading()->unit_um, any.reading()->unit_um);
    EXPECT_EQ(known.reading()->alarms, any.reading()->alarms);
    EXPECT_EQ(known.reading()->latched, any.reading()->latched);
  }
}

constexpr Format known_default{};
constexpr Format known_turns{.word = word_with_status({.position = 19, .multiturn = 16}), .ma_khz = 4000};
constexpr Format known_life_counter{
    .word = word_with_status({.position = 32, .multiturn = 12}), .check = crc16, .latency = 5us};
constexpr Format known_linear{.word = word_with_status({.position = 26}), .scale = {.linear = true, .unit_um = 0.5}};

TEST(BissHost, ReadsCompileTimeFormatLikeRunTimeFormat) {
  reads_as_any_format<known_default>();
  reads_as_any_format<known_turns>();
  reads_as_any_format<known_life_counter>();
  reads_as_any_format<known_linear>();
}

// A late frame whose delay is not repeated may be the result of a lost start bit.
TEST(BissHost, RejectsLateFramesThatDoNotAgree) {
  FindPosition<Format> read(turns_19);
  Time now{};
  unsigned frames = 0;
  for (unsigned ack = 14; ack < 40; ack += 4) {
    Step<std::uint8_t> step = read.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::configure) step = read.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::done) break;
    ++frames;
    BitBuffer<512> frame;
    EXPECT_TRUE(encode(turns_19, {.ack_bits = ack}, frame));
    std::vector<std::uint8_t> bytes(frame.bytes().begin(), frame.bytes().end());
    bytes.resize(step.expect);
    now = step.at + 100us;
    read.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    read.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = bytes});
  }
  EXPECT_EQ(frames, 5u);
  EXPECT_EQ(read.error(), Error::truncated);
  EXPECT_EQ(read.reading(), nullptr);
}

// README, section Timing: with default options a host gives enough clocks for an encoder that needs 10 us for a
// position.
template <class F>
void expect_ten_microseconds() {
  testing::ClockedBench<VirtualEncoderOf<F>> bench(line_settings, F{}, Behaviour{.latency = 10us});
  PositionReader<F, false> read(F{});
  EXPECT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}
TEST(BissHost, AssumesLatencyOfTenMicroseconds) {
  expect_ten_microseconds<Format>();
  expect_ten_microseconds<SafetyFormat>();
  expect_ten_microseconds<ChainFormat>();
}

// The host pauses 40 us before and after the two pulses of the start sequence.
TEST(BissHost, SendsStartSequenceWhenFirstFrameIsStuck) {
  Format format = turns_19;
  format.start_sequence = true;
  Bench bench(line_settings, format);
  std::vector<sim::Line<std::uint8_t>::Transfer> seen;
  std::vector<std::size_t> clocks;
  bench.line.observe_transfers([&](const sim::Line<std::uint8_t>::Transfer& one) {
    seen.push_back(one);
    clocks.push_back(one.bits);
  });
  const std::size_t frame = ProtocolOf<Format>::clocks(format);
  FindPosition<Format> first(format);
  ASSERT_EQ(bench.run(first).error(), Error::none);
  EXPECT_EQ(clocks, (std::vector<std::size_t>{frame, start_pulses, frame}));
  ASSERT_EQ(seen.size(), 3u);
  for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_EQ(seen[i].start - seen[i - 1].end, 40us);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  EXPECT_EQ(bench.encoder.answer_count(), 1u);

  clocks.clear();
  FindPosition<Format> again(format);
  ASSERT_EQ(bench.run(again).error(), Error::none);
  EXPECT_EQ(clocks, std::vector<std::size_t>{frame});

  bench.encoder.power_off(bench.line.now());
  bench.encoder.power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::skip);
  clocks.clear();
  ReadPosition plain(format);
  EXPECT_EQ(bench.run(plain).error(), Error::line_stuck);
  FindPosition<Format> found(format);
  EXPECT_EQ(bench.run(found).error(), Error::none);
  EXPECT_EQ(clocks, (std::vector<std::size_t>{frame, frame, start_pulses, frame}));

  bench.encoder.power_off(bench.line.now());
  clocks.clear();
  FindPosition<Format> nobody(format);
  EXPECT_EQ(bench.run(nobody).error(), Error::line_stuck);
  // The host's last transfer has enough clocks for the longest delay of the line that it searches.
  const std::size_t longest = ProtocolOf<Format>::all_clocks(format);
  EXPECT_EQ(clocks, (std::vector<std::size_t>{frame, start_pulses, frame, longest}));
}

TEST(BissHost, ClocksLongerBeforeReportingStuckLine) {
  for (const auto& [khz, latency, delay] :
       std::to_array<std::tuple<std::uint16_t, Time, std::uint32_t>>({{1000, 10us, 39'500}, {10'000, 1us, 5'050}})) {
    Format format = turns_19;
    format.ma_khz = khz;
    format.latency = latency;
    format.line_delay_ns = delay;
    Bench bench(line_settings, format);
    bench.shaft.state.position = 0x1234'5678;
    FindPosition<Format> found(format);
    ASSERT_EQ(bench.run(found).error(), Error::none) << khz << " kHz, " << delay << " ns";
    EXPECT_EQ(found.reading()->singleturn, 0x1234'5678u >> 13);
  }
}

TEST(BissHost, ExplainsErrors) {
  const auto found = [](Error error, std::int64_t latency_ns) {
    Options options;
    EXPECT_EQ(resolve_options(unit, {}, {}, options).kind, OptionError::Kind::none);
    for (std::size_t i = 0; i < unit.options.size(); ++i) {
      if (unit.options[i].name == "latency_us") options.values[i] = latency_ns;
    }
    return unit.explain(options, error, {}, {}).detail;
  };
  EXPECT_NE(found(Error::truncated, 10'000).find("raise it"), std::string_view::npos);
  EXPECT_NE(found(Error::bad_checksum, 10'000).find("try another one"), std::string_view::npos);
  EXPECT_NE(found(Error::invalid_argument, 1'000'000).find("lower latency_us"), std::string_view::npos);
  // If a frame has at most 512 clocks, invalid_argument has no explanation, because then the word format is invalid.
  EXPECT_EQ(found(Error::invalid_argument, 10'000), "");
  EXPECT_EQ(found(Error::line_stuck, 10'000), "");
}

// ---- BiSS Safety: each reading takes two frames

const Format safety{.word = word_with_status({.position = 24}), .check = crc16};

/// Reads two frames with these life counters, the second with bit `flip` wrong.
Error read_safety(std::uint8_t first, std::uint8_t second, std::size_t flip = ~std::size_t{0}) {
  ReadPosition read(safety);
  Time now{};
  for (const std::uint8_t counter : {first, second}) {
    Step<std::uint8_t> step = read.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::configure) step = read.next(now);
    EXPECT_EQ(step.kind, Step<std::uint8_t>::Kind::transfer);
    EXPECT_EQ(step.at, now + timeout_maximum);
    EXPECT_EQ(read.reading(), nullptr);
    BitBuffer<512> frame;
    EXPECT_TRUE(encode(safety, {.word = {.position = 0xABCDE0u + counter}, .life_counter = counter}, frame));
    std::vector<std::uint8_t> bytes(frame.bytes().begin(), frame.bytes().end());
    bytes.resize(step.expect);
    if (counter == second && flip / 8 < bytes.size()) bytes[flip / 8] ^= static_cast<std::uint8_t>(0x80u >> flip % 8);
    now = step.at + 60us;
    read.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    read.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = bytes});
  }
  EXPECT_EQ(read.next(now).kind, Step<std::uint8_t>::Kind::done);
  EXPECT_EQ(read.reading() != nullptr, read.error() == Error::none);
  if (const Reading* reading = read.reading()) {
    EXPECT_EQ(reading->singleturn, 0xABCDE0u + second);
  }
  return read.error();
}

TEST(BissHost, SafetyReadingNeedsAdvancingLifeCounter) {
  EXPECT_EQ(read_safety(41, 42), Error::none);
  EXPECT_EQ(read_safety(63, 0), Error::none);
  EXPECT_EQ(read_safety(0, 1), Error::none);
  EXPECT_EQ(read_safety(41, 41), Error::sequence_mismatch);
  EXPECT_EQ(read_safety(41, 43), Error::sequence_mismatch);
  EXPECT_EQ(read_safety(41, 40), Error::sequence_mismatch);
  EXPECT_EQ(read_safety(0, 63), Error::sequence_mismatch);
  EXPECT_EQ(read_safety(41, 42, 20), Error::bad_checksum);
}

TEST(BissHost, LifeCounterWrapsToZero) {
  Bench bench(line_settings, safety);
  for (int i = 0; i < 70; ++i) {
    ReadPosition read(safety);
    ASSERT_EQ(bench.run(read).error(), Error::none) << i;
    EXPECT_EQ(read.last().life_counter, (2 * i + 1) % 64);
  }
}

}  // namespace
}  // namespace absenc::biss
