// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/async.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "absenc/capture/files/memory_reader_test.hpp"
#include "absenc/capture/lines/pipeline.hpp"

namespace absenc::capture {
namespace {

constexpr AsyncFormat format{.bit = 8};

std::vector<Character> decoded(const Drawn& levels, const AsyncFormat& of) {
  AsyncDecoder decoder(of);
  std::vector<Character> characters;
  decoder.decode(changes_of(levels, levels.front() != 0, 0, levels.size()), 0, levels.size(), characters);
  decoder.finish(characters);
  return characters;
}

std::vector<std::uint8_t> values(const std::vector<Character>& characters) {
  std::vector<std::uint8_t> bytes;
  for (const Character& c : characters) bytes.push_back(c.value);
  return bytes;
}

struct DecodedCharacters {
  std::vector<Character> characters;
  AsyncOutcome outcome;
};

DecodedCharacters decoded(Reader& reader, const std::vector<AsyncLine>& lines, unsigned threads = 2) {
  DecodedCharacters all;
  all.outcome = decode_async(reader, lines, threads, [&](const DecodedPart& part) {
    all.characters.insert(all.characters.end(), part.characters.begin(), part.characters.end());
    return true;
  });
  return all;
}

TEST(Async, ACharacterLastsFromItsStartBitToTheEndOfItsStopBit) {
  Pen pen(8, Parity::none, 1);
  pen.hold(true, 12);
  pen.character(0x1A);
  pen.hold(true, 3);
  const auto found = decoded(pen.levels, format);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].begin, 96u);
  EXPECT_EQ(found[0].end, 176u);
  EXPECT_EQ(found[0].value, 0x1A);
  EXPECT_FALSE(found[0].bad_stop || found[0].bad_parity || found[0].is_break);
}

TEST(Async, ANextCharacterThatComesEarlyEndsTheOneBefore) {
  Pen pen(7.8, Parity::none, 1);  // bits last 7.8 ticks instead of 8: the sender is 2.5 % too fast
  pen.hold(true, 12);
  pen.character(0x55);
  pen.character(0xAA);
  pen.hold(true, 3);
  const auto found = decoded(pen.levels, format);
  ASSERT_EQ(values(found), (std::vector<std::uint8_t>{0x55, 0xAA}));
  EXPECT_EQ(found[0].end, found[1].begin);
}

TEST(Async, ReportsBreakAndFramingError) {
  Pen pen(8, Parity::none, 1);
  pen.hold(true, 12);
  pen.hold(false, 14);
  pen.hold(true, 2);
  pen.character(0x00, true, false);
  pen.hold(true, 2);
  pen.character(0x81, true, false);
  pen.hold(true, 2);
  pen.character(0x42);
  const auto found = decoded(pen.levels, format);
  ASSERT_EQ(values(found), (std::vector<std::uint8_t>{0, 0, 0x81, 0x42}));
  EXPECT_TRUE(found[0].is_break && found[0].bad_stop);
  EXPECT_TRUE(found[1].is_break && found[1].bad_stop);
  EXPECT_TRUE(!found[2].is_break && found[2].bad_stop);
  EXPECT_TRUE(!found[3].is_break && !found[3].bad_stop);
}

TEST(Async, ReportsWrongParity) {
  for (const Parity parity : {Parity::odd, Parity::even}) {
    Pen pen(8, parity, 2);
    pen.hold(true, 12);
    pen.character(0x31);
    pen.character(0x31, false);
    pen.character(0x30);
    const auto found = decoded(pen.levels, {.bit = 8, .parity = parity, .stop_bits = 2});
    ASSERT_EQ(values(found), (std::vector<std::uint8_t>{0x31, 0x31, 0x30}));
    EXPECT_FALSE(found[0].bad_parity);
    EXPECT_TRUE(found[1].bad_parity);
    EXPECT_FALSE(found[2].bad_parity);
    EXPECT_EQ(found[1].begin - found[0].begin, 96u);
  }
}

TEST(Async, DecodesCharactersOfFiveToSixteenDataBits) {
  for (unsigned data_bits = 5; data_bits <= 16; ++data_bits) {
    for (const Parity parity : {Parity::none, Parity::odd, Parity::even}) {
      const unsigned mask = (1u << data_bits) - 1;
      const std::vector<unsigned> wanted{0x1234 & mask, mask, 0, 1u << (data_bits - 1), 0xA5A5 & mask};
      Pen pen(8, parity, 1, data_bits);
      pen.hold(true, 20);
      for (const unsigned value : wanted) pen.character(value);
      pen.character(wanted[0], false);
      pen.hold(true, 3);
      const auto found = decoded(pen.levels, {.bit = 8, .parity = parity, .data_bits = data_bits});
      ASSERT_EQ(found.size(), wanted.size() + 1) << data_bits;
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        EXPECT_EQ(found[i].high << 8 | found[i].value, static_cast<int>(wanted[i])) << data_bits;
        EXPECT_FALSE(found[i].bad_stop || found[i].bad_parity) << data_bits;
      }
      EXPECT_EQ(found.back().bad_parity, parity != Parity::none);
      EXPECT_EQ(found[1].begin - found[0].begin, 8 * (2 + data_bits + (parity == Parity::none ? 0 : 1)));
    }
  }
}

TEST(AsyncPipeline, MakesTwoCharactersOfOneWithMoreThanEightDataBits) {
  for (const double baud : {0.0, 125e6}) {
    Pen pen(8, Parity::none, 1, 16);
    pen.hold(true, 40);
    for (unsigned i = 0; i < 40; ++i) pen.character(0x1234 + 0x0517 * i);
    pen.hold(true, 40);
    Pen other(8, Parity::none, 1, 16);
    other.hold(true, 50);
    other.character(0xBEEF);
    other.hold(true, 1);
    other.levels.resize(pen.levels.size(), 1);
    const Wires wires{{pen.levels, other.levels}};
    for (const std::size_t lines : {1u, 2u}) {
      MemoryReader reader(wires, Content::samples, 1000, 3);
      std::vector<AsyncLine> settings;
      for (unsigned i = 0; i < lines; ++i) settings.push_back({i, {.baud = baud, .data_bits = 16}});
      const auto all = decoded(reader, settings);
      ASSERT_EQ(all.outcome.problem, "");
      std::vector<Character> found;
      for (const Character& one : all.characters) {
        if (one.channel == 0) found.push_back(one);
      }
      ASSERT_EQ(found.size(), 80u) << baud << " " << lines;
      for (std::size_t i = 0; i < 40; ++i) {
        const unsigned value = (0x1234 + 0x0517 * static_cast<unsigned>(i)) & 0xFFFF;
        EXPECT_EQ(found[2 * i].value, value & 0xFF);
        EXPECT_EQ(found[2 * i + 1].value, value >> 8);
        EXPECT_EQ(found[2 * i].end, found[2 * i + 1].begin);
        EXPECT_EQ(found[2 * i].begin, 320 + 144 * i);
        EXPECT_EQ(found[2 * i].end, found[2 * i].begin + 72);
      }
      EXPECT_EQ(all.characters.size(), lines == 1 ? 80u : 82u);
    }
  }
}

TEST(Async, APulseShorterThanHalfABitIsNoStartBit) {
  Pen pen(8, Parity::none, 1);
  pen.hold(true, 12);
  pen.hold(false, 0.4);
  pen.hold(true, 5);
  pen.character(0x42);
  EXPECT_EQ(values(decoded(pen.levels, format)), (std::vector<std::uint8_t>{0x42}));
}

TEST(Async, TheFilterRemovesGlitchesInsideACharacter) {
  Pen pen(8, Parity::none, 1);
  pen.hold(true, 12);
  pen.character(0xFF);
  auto levels = pen.levels;
  for (const std::size_t tick : {108u, 109u, 132u, 133u}) levels[tick] = false;
  EXPECT_NE(values(decoded(levels, format)), (std::vector<std::uint8_t>{0xFF}));
  EXPECT_EQ(values(decoded(levels, {.bit = 8, .glitch = 3})), (std::vector<std::uint8_t>{0xFF}));
}

TEST(Async, ACaptureMayBeginInsideACharacter) {
  Pen pen(8, Parity::none, 1);
  pen.hold(true, 12);
  std::vector<std::uint8_t> sent;
  for (unsigned i = 0; i < 40; ++i) {
    sent.push_back(static_cast<std::uint8_t>(i * 0x9E3779B97F4A7C15u >> 24));
    pen.character(sent.back());
  }
  const std::vector<std::uint8_t> rest(sent.begin() + 5, sent.end());
  for (std::size_t cut = 96 + 4 * 80 + 9; cut < 96 + 5 * 80; ++cut) {
    const Drawn levels(pen.levels.begin() + static_cast<std::ptrdiff_t>(cut), pen.levels.end());
    const auto found = values(decoded(levels, format));
    ASSERT_GE(found.size(), rest.size()) << cut;
    EXPECT_TRUE(std::equal(rest.rbegin(), rest.rend(), found.rbegin())) << cut;
    EXPECT_LE(found.size(), rest.size() + 1) << cut;
  }
}

TEST(Async, SeesChangeBetweenPartsOnce) {
  const auto begin_of = [](const Changes& second) {
    std::vector<Character> characters;
    AsyncDecoder decoder(format);
    decoder.decode({true, {}}, 0, 100, characters);
    decoder.decode(second, 100, 400, characters);
    return characters.size() == 1 ? characters[0].begin : 0;
  };
  EXPECT_EQ(begin_of({true, {100, 108}}), 100u);
  EXPECT_EQ(begin_of({false, {108}}), 100u);
}

TEST(Async, RestartsBehindAHole) {
  Pen pen(8, Parity::none, 1);
  pen.hold(true, 20);
  for (unsigned i = 0; i < 30; ++i) {
    pen.character(static_cast<std::uint8_t>(i));
    pen.hold(true, 11);
  }
  const Wires wires{{pen.levels}};
  for (const unsigned threads : {1u, 3u}) {
    for (const Content content : {Content::samples, Content::changes}) {
      MemoryReader reader(wires, content, 100, 1);
      // The part left out is from the middle of character 10 to the pause before character 20.
      reader.leave_out(160 + 10 * 168 + 30, 160 + 20 * 168 - 85);
      std::vector<std::uint8_t> wanted;
      for (unsigned i = 0; i < 30; ++i) {
        if (i < 10 || i >= 20) wanted.push_back(static_cast<std::uint8_t>(i));
      }
      EXPECT_EQ(values(decoded(reader, {{0, {.baud = 125e6}}}, threads).characters), wanted);
    }
  }
}

TEST(Async, ASilentLineTakesTheBaudRateOfAnother) {
  Pen pen(10.5, Parity::none, 1);
  pen.hold(true, 12);
  for (unsigned i = 0; i < 200; ++i) pen.character(static_cast<std::uint8_t>(i * 77));
  Wires wires{{pen.levels, Drawn(pen.levels.size(), true)}, 1'050'000};
  MemoryReader reader(wires, Content::samples, 1000, 1);
  const DecodedCharacters all = decoded(reader, {{1, {}}, {0, {}}});
  EXPECT_EQ(all.outcome.problem, "");
  EXPECT_EQ(all.characters.size(), 200u);
  EXPECT_EQ(all.characters.front().channel, 1);
  EXPECT_NEAR(all.outcome.formats[0].bit, 10.5, 0.05);
  // all characters have the same rounding error, so a wide tolerance of the measured baud rate is needed
  EXPECT_NEAR(all.outcome.measured_baud[1], 100'000, 500);
  EXPECT_EQ(all.outcome.measured_baud[0], 0);
}

TEST(Async, DetectionDoesNotDependOnBlocks) {
  Wires wires{{{}}};
  for (const double bit : {5.0, 5.05}) {
    Pen pen(bit, Parity::none, 1);
    pen.hold(true, 12);
    for (unsigned i = 0; i < 2500; ++i) pen.character(static_cast<std::uint8_t>(i * 0x9E3779B1u >> 24));
    wires.levels[0].insert(wires.levels[0].end(), pen.levels.begin(), pen.levels.end());
  }
  std::optional<double> bit;
  for (const std::size_t most : {1000u, 70'000u, 10'000'000u}) {
    MemoryReader reader(wires, Content::samples, most, 1);
    const DecodedCharacters all = decoded(reader, {{0, {}}});
    EXPECT_EQ(all.characters.size(), 5000u);
    EXPECT_EQ(all.outcome.formats[0].bit, bit.value_or(all.outcome.formats[0].bit)) << most;
    bit = all.outcome.formats[0].bit;
  }
}

TEST(Async, ReportsWhyLineCannotBeDecoded) {
  Pen pen(8, Parity::none, 1);
  pen.hold(true, 12);
  pen.character(0x55);
  Wires wires{{pen.levels, Drawn(pen.levels.size(), true)}};
  const auto problem = [&](const AsyncLine& line) {
    MemoryReader reader(wires, Content::samples, 1000, 1);
    return decoded(reader, {line}).outcome.problem;
  };
  EXPECT_EQ(problem({1, {}}), "D1 never changes its level: is it the right channel, and was it connected?");
  EXPECT_EQ(problem({7, {}}), "there is no channel 7: the file has 2 channels, counted from 0");
  EXPECT_EQ(problem({0, {.baud = 1e9}}).substr(0, 34), "a bit of D0 would last 1.000000 sa");
  wires.ticks_per_second = 0;
  EXPECT_EQ(problem({0, {.baud = 9600}}).substr(0, 45), "the file does not tell how long a sample last");
  EXPECT_EQ(problem({0, {}}), "");
}

TEST(Async, NoiseHasNoBaudRate) {
  Random random(1);
  Wires wires{{{}}};
  for (unsigned i = 0; i < 20'000; ++i) wires.levels[0].push_back(random() % 2);
  MemoryReader reader(wires, Content::samples, 1000, 1);
  EXPECT_EQ(decoded(reader, {{0, {}}}).outcome.problem.substr(0, 52),
            "no baud rate explains D0, which changes its level 99");
}

TEST(Async, StopsWhenSinkReturnsFalse) {
  Pen pen(8, Parity::none, 1);
  for (unsigned i = 0; i < 1000; ++i) pen.character(0x55);
  const Wires wires{{pen.levels}};
  for (const unsigned threads : {1u, 3u}) {
    MemoryReader reader(wires, Content::samples, 100, 1);
    unsigned parts = 0;
    decode_async(reader, std::vector<AsyncLine>{{0, {.baud = 125e6, .idle = Idle::high}}}, threads,
                 [&](const DecodedPart&) { return ++parts < 5; });
    EXPECT_EQ(parts, 5u);
  }
}

struct Failing : Reader {
  explicit Failing(Reader& other) : reader(other) {}
  [[nodiscard]] const Layout& layout() const override { return reader.layout(); }
  [[nodiscard]] bool claim(Block& block) override { return reader.claim(block); }
  void fill(Block& block) override {
    if (block.index == 7) throw std::runtime_error("disk");
    reader.fill(block);
  }
  [[nodiscard]] const std::vector<Damage>& damages() const override { return reader.damages(); }
  Reader& reader;
};

TEST(Async, PassesOnExceptionsOfReader) {
  const Wires wires{{Drawn(10'000, true)}};
  for (const unsigned threads : {1u, 2u, 5u}) {
    MemoryReader memory(wires, Content::samples, 100, 1);
    Failing reader(memory);
    EXPECT_THROW(decoded(reader, {{0, {.baud = 125e6, .idle = Idle::high}}}, threads), std::runtime_error);
  }
}

// A reader whose `claim` is slow: meanwhile the other threads must decode earlier blocks.
class Slow final : public Reader {
 public:
  explicit Slow(Reader& reader) : reader_(reader) {}

  [[nodiscard]] const Layout& layout() const override { return reader_.layout(); }
  [[nodiscard]] const std::vector<Damage>& damages() const override { return reader_.damages(); }

  // Makes each thread, except that which joins the results, wait until all claimed blocks were delivered.
  [[nodiscard]] bool claim(Block& block) override {
    std::unique_lock lock(mutex_);
    if (!is_joining() && claimed_ != arrived_) {
      overlaps_ = true;
      changed_.notify_all();
      wait(lock, [this] { return claimed_ == arrived_; });
    }
    const bool more = reader_.claim(block);
    claimed_ += more ? 1 : 0;
    return more;
  }
  // Makes the thread that joins the results wait until another thread claims a block at the same time.
  void fill(Block& block) override {
    std::unique_lock lock(mutex_);
    if (is_joining()) wait(lock, [this] { return overlaps_; });
    reader_.fill(block);
  }
  void arrive() {
    const std::lock_guard lock(mutex_);
    ++arrived_;
    changed_.notify_all();
  }
  [[nodiscard]] bool held_up() const { return held_up_; }

 private:
  [[nodiscard]] bool is_joining() const { return std::this_thread::get_id() == joining_; }
  template <class Condition>
  void wait(std::unique_lock<std::mutex>& lock, Condition condition) {
    held_up_ = held_up_ || !changed_.wait_for(lock, std::chrono::minutes(1), condition);
  }

  Reader& reader_;
  std::thread::id joining_ = std::this_thread::get_id();
  std::mutex mutex_;
  std::condition_variable changed_;
  unsigned claimed_ = 0;
  unsigned arrived_ = 0;
  bool overlaps_ = false;
  bool held_up_ = false;
};

TEST(Async, ClaimingDoesNotBlockDecoding) {
  Pen pen(8, Parity::none, 1);
  for (unsigned i = 0; i < 2000; ++i) pen.character(0x55);
  const Wires wires{{pen.levels}};
  MemoryReader memory(wires, Content::samples, 1000, 1);
  Slow reader(memory);
  decode_async(reader, std::vector<AsyncLine>{{0, {.baud = 125e6, .idle = Idle::high}}}, 2, [&](const DecodedPart&) {
    reader.arrive();
    return true;
  });
  EXPECT_FALSE(reader.held_up());
}

}  // namespace
}  // namespace absenc::capture
