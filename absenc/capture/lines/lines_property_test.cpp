// SPDX-License-Identifier: Apache-2.0
// Checks that one thread, many threads and simple decoders give the same result.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <tuple>

#include "absenc/capture/files/memory_reader_test.hpp"
#include "absenc/capture/lines/edges.hpp"
#include "absenc/capture/lines/pipeline.hpp"
#include "absenc/capture/lines/slow_decoders_test.hpp"

namespace absenc::capture {
namespace {

auto tied(const Character& c) {
  return std::tuple(c.begin, c.end, c.value, c.channel, c.bad_parity, c.bad_stop, c.is_break);
}
auto tied(const Burst& b) {
  return std::tuple(b.begin, b.end, b.bits, b.in, b.out, b.cut, b.low_before, b.low_after, b.fell_before);
}

template <class Item>
bool equal(const std::vector<Item>& a, const std::vector<Item>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Item& x, const Item& y) { return tied(x) == tied(y); });
}

struct Line {
  AsyncSettings settings;
  Drawn levels;
};

// Returns a random line of characters, perhaps with pauses, breaks, wrong bits and noise.
Line any_line(Random& random, std::uint64_t ticks_per_second) {
  Line line;
  const double bit = below(random, 2) == 0 ? 3.0 + static_cast<double>(below(random, 1000)) / 100
                                           : 3.0 + static_cast<double>(below(random, 300'000)) / 1000;
  line.settings = {.baud = static_cast<double>(ticks_per_second) / bit,
                   .parity = std::array{Parity::none, Parity::odd, Parity::even}[below(random, 3)],
                   .stop_bits = static_cast<unsigned>(1 + below(random, 2)),
                   .idle = below(random, 2) == 0 ? Idle::high : Idle::low,
                   .glitch = below(random, 3) == 0 ? 1 + below(random, static_cast<std::uint64_t>(bit)) : 0};
  const double off = 0.985 + static_cast<double>(below(random, 31)) / 1000;
  Pen pen(bit * off, line.settings.parity, line.settings.stop_bits);
  const bool dense = below(random, 2) == 0;
  for (std::uint64_t i = below(random, 30); i > 0; --i) {
    if (!dense) pen.hold(true, static_cast<double>(below(random, 300)) / 10);
    if (below(random, 15) == 0) {
      pen.hold(false, static_cast<double>(5 + below(random, 30)));
      pen.hold(true, 1);
    } else {
      pen.character(static_cast<std::uint8_t>(below(random, 256)), below(random, 20) != 0, below(random, 20) != 0);
    }
  }
  line.levels = std::move(pen.levels);
  if (line.settings.idle == Idle::low) invert(line.levels);
  line.levels.erase(line.levels.begin(),
                    line.levels.begin() + static_cast<std::ptrdiff_t>(below(random, line.levels.size() / 3 + 1)));
  if (line.levels.empty()) line.levels.push_back(true);
  if (below(random, 2) == 0) {
    for (std::uint64_t i = below(random, 60); i > 0; --i) {
      const std::size_t at = below(random, line.levels.size());
      line.levels[at] ^= 1;
    }
  }
  return line;
}

struct DecodeSetup {
  unsigned threads;
  Content content;
};
constexpr std::array decode_setups{DecodeSetup{1, Content::samples}, DecodeSetup{1, Content::changes},
                                   DecodeSetup{2, Content::samples}, DecodeSetup{3, Content::changes},
                                   DecodeSetup{5, Content::samples}};

std::size_t any_block_size(Random& random, std::size_t ticks) {
  // With blocks smaller than this number of ticks a test case would take a second.
  const std::size_t least = ticks / 200 + 1;
  return least + below(random, below(random, 2) == 0 ? 8 : ticks);
}

std::vector<Character> decoded(Reader& reader, std::span<const AsyncLine> lines, unsigned threads,
                               AsyncOutcome& outcome) {
  std::vector<Character> found;
  Tick end = 0;
  outcome = decode_async(reader, lines, threads, [&](const DecodedPart& part) {
    for (const Character& c : part.characters) RC_ASSERT(c.begin >= end);
    found.insert(found.end(), part.characters.begin(), part.characters.end());
    end = part.end;
    return true;
  });
  RC_ASSERT(outcome.problem.empty());
  return found;
}

bool same(const AsyncOutcome& a, const AsyncOutcome& b) {
  for (std::size_t i = 0; i < a.statistics.size(); ++i) {
    const auto &x = a.statistics[i], &y = b.statistics[i];
    if (x.ticks != y.ticks || x.bits != y.bits || x.characters != y.characters || x.faults != y.faults) return false;
    if (a.formats[i].bit != b.formats[i].bit || a.formats[i].idle_high != b.formats[i].idle_high) return false;
  }
  return a.measured_baud == b.measured_baud;
}

RC_GTEST_PROP(LinesProperty, AsyncResultDoesNotDependOnThreadsAndBlocks, (std::uint64_t seed)) {
  Random random(seed);
  Wires wires;
  std::vector<AsyncLine> lines;
  std::vector<Character> wanted;
  const std::size_t count = 1 + below(random, 3);
  const std::size_t channels = count + below(random, below(random, 4) == 0 ? 62 : 6);
  wires.levels.resize(channels);
  std::size_t ticks = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Line line = any_line(random, wires.ticks_per_second);
    unsigned channel = 0;
    do channel = static_cast<unsigned>(below(random, channels));
    while (!wires.levels[channel].empty());
    ticks = std::max(ticks, line.levels.size());
    wires.levels[channel] = std::move(line.levels);
    lines.push_back({channel, line.settings});
  }
  for (auto& levels : wires.levels) levels.resize(ticks, !levels.empty() && levels.back());
  for (std::size_t i = 0; i < count; ++i) {
    const AsyncSettings& s = lines[i].settings;
    const AsyncFormat format{static_cast<double>(wires.ticks_per_second) / s.baud, s.idle == Idle::high, s.parity,
                             s.stop_bits, s.glitch};
    const auto slow = SlowDecoder(wires.levels[lines[i].channel], format, static_cast<std::uint8_t>(i)).decode();
    wanted.insert(wanted.end(), slow.begin(), slow.end());
  }
  std::stable_sort(wanted.begin(), wanted.end(), [](const auto& a, const auto& b) { return a.begin < b.begin; });

  AsyncOutcome first;
  for (const DecodeSetup& setup : decode_setups) {
    MemoryReader reader(wires, setup.content, any_block_size(random, ticks), random());
    AsyncOutcome outcome;
    const auto found = decoded(reader, lines, setup.threads, outcome);
    RC_ASSERT(equal(found, wanted));
    if (first.formats.empty()) first = outcome;
    RC_ASSERT(same(outcome, first));
  }
}

RC_GTEST_PROP(LinesProperty, BaudAndIdleLevelAreFound, (std::uint64_t seed)) {
  Random random(seed);
  const double bit = 3.0 + static_cast<double>(below(random, below(random, 2) == 0 ? 3000 : 200'000)) / 1000;
  const Parity parity = std::array{Parity::none, Parity::odd, Parity::even}[below(random, 3)];
  const bool dense = below(random, 2) == 0;
  Pen pen(bit, parity, 1);
  std::vector<std::uint8_t> sent;
  pen.hold(true, 12);
  const std::uint64_t count = 30 + below(random, 100);
  for (std::uint64_t i = 0; i < count; ++i) {
    if (!dense && below(random, 5) == 0) pen.hold(true, static_cast<double>(below(random, 900)) / 10);
    sent.push_back(static_cast<std::uint8_t>(random()));
    pen.character(sent.back());
  }
  pen.hold(true, 2);
  const bool idle_high = below(random, 2) == 0;
  if (!idle_high) invert(pen.levels);
  const Wires wires{{pen.levels}};
  const std::vector<AsyncLine> lines{{0, {.parity = parity}}};

  AsyncOutcome first;
  for (const unsigned threads : {1u, 3u}) {
    for (const Content content : {Content::samples, Content::changes}) {
      MemoryReader reader(wires, content, any_block_size(random, wires.ticks()), random());
      AsyncOutcome outcome;
      std::vector<std::uint8_t> bytes;
      for (const Character& c : decoded(reader, lines, threads, outcome)) bytes.push_back(c.value);
      RC_ASSERT(outcome.formats[0].idle_high == idle_high);
      // The measured bit time may be wrong by a sample in 8 bits, because all characters may have the same rounding
      // error.
      RC_ASSERT(std::abs(outcome.formats[0].bit - bit) < 0.01 * bit + 1.0 / 8);
      RC_ASSERT(bytes == sent);
      if (first.formats.empty()) first = outcome;
      RC_ASSERT(same(outcome, first));
    }
  }
}

RC_GTEST_PROP(LinesProperty, ClockedResultDoesNotDependOnThreadsAndBlocks, (std::uint64_t seed)) {
  Random random(seed);
  Wires wires;
  wires.levels.resize(4);
  auto& clock = wires.levels[0];
  auto& in = wires.levels[1];
  auto& out = wires.levels[2];
  auto& select = wires.levels[3];
  const std::size_t half = 1 + below(random, 6);
  const bool idle = below(random, 2) == 0;
  const bool active = below(random, 2) == 0;
  const auto hold = [&](bool level, bool selected, std::size_t ticks) {
    for (std::size_t i = 0; i < ticks; ++i) {
      clock.push_back(level);
      select.push_back(selected == active);
    }
  };
  for (std::uint64_t words = 1 + below(random, 12); words > 0; --words) {
    hold(idle, false, below(random, 2) == 0 ? below(random, 20 * half) : 8 * half);
    hold(idle, true, below(random, 4));
    for (std::uint64_t bits = below(random, 40); bits > 0; --bits) {
      hold(!idle, true, half + below(random, 2));
      hold(idle, true, half + (below(random, 30) == 0 ? 9 * half : 0));
    }
    hold(idle, true, below(random, 4));
  }
  hold(idle, below(random, 2) == 0, 1 + below(random, 12 * half));
  const std::size_t ticks = clock.size();
  for (auto* data : {&in, &out}) {
    while (data->size() < ticks)
      data->resize(std::min(ticks, data->size() + 1 + static_cast<std::size_t>(below(random, 3 * half))),
                   random() % 2 == 0);
  }
  for (auto& levels : wires.levels) {
    for (std::uint64_t i = below(random, 3) == 0 ? below(random, 10) : 0; i > 0; --i) levels[below(random, ticks)] ^= 1;
  }
  const bool has_select = below(random, 2) == 0;
  const ClockedFormat format{.rising = below(random, 2) == 0,
                             .has_select = has_select,
                             .select_high = active,
                             .pause = 2 * half + below(random, 5 * half),
                             .settle = has_select ? 0 : below(random, half),
                             .change_pause = has_select ? 0 : below(random, 2) * (half + below(random, 2 * half))};
  const std::vector<Burst> wanted = SlowClocked{wires.levels, format}.decode();
  const ClockedLine line{.clock = 0,
                         .in = 1,
                         .out = 2,
                         .select = has_select ? std::optional(3u) : std::nullopt,
                         .rising = format.rising,
                         .select_high = active,
                         .pause = format.pause,
                         .settle = format.settle,
                         .change_pause = format.change_pause};
  for (const DecodeSetup& setup : decode_setups) {
    MemoryReader reader(wires, setup.content, any_block_size(random, ticks), random());
    std::vector<Burst> found;
    decode_clocked(reader, line, setup.threads, [&](const DecodedPart& part) {
      found.insert(found.end(), part.bursts.begin(), part.bursts.end());
      return true;
    });
    RC_ASSERT(equal(found, wanted));
  }
}

// ---- Conversion of samples to changes

RC_GTEST_PROP(LinesProperty, ChangesAreThoseOfEachSample, (std::uint64_t seed)) {
  Random random(seed);
  Wires wires;
  wires.levels.resize(1 + below(random, 64));
  const std::size_t ticks = 1 + below(random, below(random, 2) == 0 ? 300 : 20000);
  std::vector<unsigned> channels;
  for (unsigned i = 0; i < wires.levels.size(); ++i) {
    const std::uint64_t rare = 1 + below(random, 100);
    bool level = false;
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      level = level != (below(random, rare) == 0);
      wires.levels[i].push_back(level);
    }
    if (below(random, 2) == 0) channels.push_back(i);
  }
  std::shuffle(channels.begin(), channels.end(), random);
  MemoryReader reader(wires, Content::samples, ticks, random());
  unsigned width = 1;
  while (width * 8 < wires.levels.size()) width *= 2;
  while (width < 8 && below(random, 2) == 0) width *= 2;
  reader.widen(width);

  std::vector<Changes> found(channels.size());
  for (Changes& each : found) each.before = random() % 2 == 0;
  for (Block block; reader.claim(block);) {
    reader.fill(block);
    std::vector<Changes> wanted;
    for (std::size_t i = 0; i < channels.size(); ++i) {
      wanted.push_back(changes_of(wires.levels[channels[i]], found[i].before, block.first, block.end));
    }
    for (const ChangeFinder find : change_finders()) {
      for (Changes& each : found) each.at.clear();
      find(block, channels, found);
      for (std::size_t i = 0; i < channels.size(); ++i) RC_ASSERT(found[i].at == wanted[i].at);
    }
    for (std::size_t i = 0; i < channels.size(); ++i) {
      found[i].before = level_after(found[i]);
      RC_ASSERT(found[i].before == (wires.levels[channels[i]][block.end - 1] != 0));
    }
  }
}

}  // namespace
}  // namespace absenc::capture
