// SPDX-License-Identifier: Apache-2.0
// Decodes clocked lines that are drawn edge by edge, without the virtual encoder.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/captures/run.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/testing.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

using capture::Annotation;

/// Draws a clock that idles high and a data line; times are in nanoseconds.
class Wires {
 public:
  void wait(std::int64_t ns) { now_ += ns; }
  void clock(bool level) { changes_[{now_, 'c'}] = level; }
  // Draws a change of the data line, `behind` nanoseconds after the clock edge that causes it.
  void data(bool level, std::int64_t behind = 5) { changes_[{now_ + behind, 'd'}] = level; }

  /// Draws `count` clock periods of `period` nanoseconds. After rising edge i, counted from 1, the data line becomes
  /// `bit(i)`.
  template <class Bit>
  void burst(std::int64_t period, std::size_t count, Bit&& bit) {
    for (std::size_t i = 0; i < count; ++i) {
      clock(false);
      wait(period / 2);
      clock(true);
      data(bit(i + 1));
      if (i + 1 < count) wait(period / 2);
    }
  }
  void write(const std::string& path) const {
    std::ofstream file(path);
    file << "$timescale 1 ns $end\n$var wire 1 c clock $end\n$var wire 1 d data $end\n$enddefinitions $end\n"
            "#0\n1c\n1d\n";
    for (const auto& [when, level] : changes_)
      file << '#' << when.first << '\n' << (level ? 1 : 0) << when.second << '\n';
    file << '#' << now_ + 1'000'000 << '\n';
  }

 private:
  std::int64_t now_ = 500'000;
  std::map<std::pair<std::int64_t, char>, bool> changes_;
};

// ---- BiSS

// Example from TI's table of BiSS register access: the host reads register 44 of slave 0, which replies 0A.
constexpr std::string_view read_44 = "0000000000000011000100010011011010000000000000000";
constexpr std::string_view read_44_answer = "0000000000000001000000000000000101000010100010000";

struct Master {
  std::int64_t period;
  std::int64_t timeout;
  // time from the last rising edge to the falling edge by which the host sends the control bit CDM as 1; 0: half a
  // period
  std::int64_t falls = 0;
  // after a control bit CDM of 1: whether the clock MA rises when the timeout has elapsed; otherwise MA stays low until
  // the next frame
  bool releases = false;
  int clocks = 0;          // number of clocks more than `biss_frame` has bits; -1: one clock fewer
  std::int64_t pause = 0;  // time from the end of the timeout to the next frame; at least `timeout` if MA was released
};

constexpr int biss_bits = 32;  // number of bits that `biss_frame` returns

// Computes a frame: two idle bits, ACK, start, CDS, 19 bits, nError, nWarning, CRC.
std::string biss_frame(std::uint32_t position, bool cds) {
  std::string word;
  for (int bit = 18; bit >= 0; --bit) word += (position >> bit & 1) != 0 ? '1' : '0';
  word += "11";
  unsigned crc = 0;
  for (const char c : word) {
    crc = (crc << 1) ^ (((crc >> 5 & 1) != (c == '1' ? 1u : 0u)) ? 0x43u : 0u);
    crc &= 0x3F;
  }
  for (int bit = 5; bit >= 0; --bit) word += (crc >> bit & 1) != 0 ? '0' : '1';
  return std::string("1101") + (cds ? '1' : '0') + word;
}

void draw_biss(Wires& wires, const Master& master, std::string_view cdm, std::string_view cds) {
  for (std::size_t i = 0; i < cdm.size(); ++i) {
    const std::string frame = biss_frame(static_cast<std::uint32_t>(1000 * i + 17), cds[i] == '1');
    wires.burst(master.period, frame.size() + static_cast<std::size_t>(master.clocks),
                [&](std::size_t at) { return at < frame.size() && frame[at] == '1'; });
    const bool low = cdm[i] == '1';
    const std::int64_t high = master.falls != 0 ? master.falls : master.period / 2;
    if (low) {
      wires.wait(high);
      wires.clock(false);
    }
    wires.wait(master.timeout - (low && master.falls != 0 ? high : 0));
    wires.data(true, 0);
    if (!low) {
      wires.wait(master.pause);
    } else if (master.releases) {
      wires.wait(10);
      wires.clock(true);
      wires.wait(std::max(master.pause, master.timeout));
    } else {
      wires.wait(master.pause);
      wires.wait(10);
      wires.clock(true);
      wires.wait(master.period / 2);
    }
  }
}

// ---- Decoding

struct Rows final : capture::AnnotationSink {
  void put(const Annotation& one) override {
    const bool cut = one.remark == capture::Remark::cut;
    words += one.kind == Annotation::Kind::reply ? 1 : 0;
    bad += one.error != Error::none ? 1 : 0;
    if (one.kind == Annotation::Kind::exchange) ++(cut ? cut_exchanges : exchanges);
    if (one.kind == Annotation::Kind::reply && one.contents.reading != nullptr) {
      positions.push_back(one.contents.reading->singleturn);
    }
  }
  unsigned words = 0;
  unsigned bad = 0;
  unsigned exchanges = 0;
  unsigned cut_exchanges = 0;
  std::vector<std::uint64_t> positions;
};

class ClockedLines : public ::testing::Test {
 protected:
  Rows decode(const Wires& wires, std::string_view unit, const std::vector<std::string>& options = {}) {
    const std::string path = (directory_.path() / "wires.vcd").string();
    wires.write(path);
    const Unit& found = require_unit(unit);
    CaptureRun run(found, require_options(found, "", options), {path, {}});
    Rows rows;
    notes_ = run.run(rows, [](capture::Tick) {}).notes;
    return rows;
  }
  static std::vector<std::uint64_t> positions(std::size_t count) {
    std::vector<std::uint64_t> all;
    for (std::size_t i = 0; i < count; ++i) all.push_back(1000 * i + 17);
    return all;
  }

  os::testing::TemporaryDirectory directory_;
  std::vector<std::string> notes_;
};

TEST_F(ClockedLines, BissOfAnyClockTimeoutAndMaster) {
  unsigned cells = 0;
  for (const std::int64_t khz : {30, 60, 80, 100, 250, 1000, 5000, 10'000}) {
    const std::int64_t period = 1'000'000 / khz;
    for (const std::int64_t timeout :
         {3 * period / 2, std::int64_t{12'500}, std::int64_t{20'000}, std::int64_t{40'000}}) {
      // skips a timeout so short that it would elapse between two edges of the clock
      if (timeout < 6 * period / 10) continue;
      for (const bool releases : {false, true}) {
        for (const int more : {-1, 0, biss_bits - 1}) {
          for (const std::int64_t pause : {0, 300'000}) {
            ++cells;
            SCOPED_TRACE(std::to_string(khz) + " kHz, timeout " + std::to_string(timeout) + " ns, " +
                         (releases ? "released, " : "held, ") + std::to_string(more) + " clocks more, pause " +
                         std::to_string(pause) + " ns");
            Wires wires;
            draw_biss(wires, {period, timeout, 0, releases, more, pause}, read_44, read_44_answer);
            const Rows rows = decode(wires, "biss");
            EXPECT_EQ(rows.bad, 0u);
            EXPECT_EQ(rows.exchanges, 1u);
            EXPECT_EQ(rows.positions, positions(read_44.size()));
            EXPECT_TRUE(notes_.empty());
          }
        }
      }
    }
  }
  EXPECT_GT(cells, 300u);
}

// A control bit may come late: the encoder samples MA only when the timeout elapses.
TEST_F(ClockedLines, AControlBitMayComeLateInTheTimeout) {
  for (const std::int64_t khz : {100, 250, 1000, 10'000}) {
    const std::int64_t period = 1'000'000 / khz;
    for (const std::int64_t timeout : {3 * period / 2, std::int64_t{20'000}, std::int64_t{40'000}}) {
      for (const std::int64_t falls : {5 * timeout / 10, 6 * timeout / 10}) {
        for (const bool releases : {false, true}) {
          // skips a falling edge of the bit CDM so early that it would count as one more clock
          if (falls < 6 * period / 10) continue;
          SCOPED_TRACE(std::to_string(khz) + " kHz, timeout " + std::to_string(timeout) + " ns, CDM behind " +
                       std::to_string(falls) + " ns, " + (releases ? "released" : "held"));
          Wires wires;
          const Master master{.period = period, .timeout = timeout, .falls = falls, .releases = releases};
          draw_biss(wires, master, read_44, read_44_answer);
          const Rows rows = decode(wires, "biss");
          EXPECT_EQ(rows.bad, 0u);
          EXPECT_EQ(rows.exchanges, 1u);
          EXPECT_EQ(rows.positions, positions(read_44.size()));
        }
      }
    }
  }
}

// The clock rests nearly as long within words as between them, so only the data line shows where words end.
TEST_F(ClockedLines, ATimeoutThatIsOverEndsAWordWhoseClockRestsAsLong) {
  constexpr std::int64_t timeout = 12'500;
  const std::string frame = biss_frame(17, false);
  std::mt19937 random(1);
  Wires wires;
  std::int64_t rest = 0;
  for (unsigned word = 0; word < 60; ++word) {
    for (std::size_t first = 0; first < frame.size(); first += 8) {
      wires.burst(1000, std::min<std::size_t>(8, frame.size() - first),
                  [&](std::size_t at) { return first + at < frame.size() && frame[first + at] == '1'; });
      rest = std::min<std::int64_t>(rest + 1 + random() % 300, timeout - 20);
      if (first + 8 < frame.size()) wires.wait(rest);
    }
    wires.wait(timeout);
    wires.data(true, 0);
    wires.wait(word < 50 ? 20 * word : 30 * word * word);
  }
  const Rows rows = decode(wires, "biss");
  EXPECT_EQ(rows.bad, 0u);
  EXPECT_EQ(rows.words, 60u);
  EXPECT_EQ(rows.positions, std::vector<std::uint64_t>(60, 17));
  EXPECT_TRUE(notes_.empty());
}

TEST_F(ClockedLines, AControlFrameThatTheFileCutsIsCut) {
  for (const std::size_t frames : {20u, 30u, 40u}) {
    Wires wires;
    draw_biss(wires, {.period = 1000, .timeout = 20'000}, read_44.substr(0, frames), read_44_answer);
    const Rows rows = decode(wires, "biss");
    EXPECT_EQ(rows.words, frames);
    EXPECT_EQ(rows.bad, 0u) << frames;
    EXPECT_EQ(rows.cut_exchanges + rows.exchanges, 1u) << frames;
    EXPECT_EQ(rows.cut_exchanges, 1u) << frames;
  }
}

// ---- SSI

constexpr unsigned ssi_bits = 13;

// Draws words with different positions; if a word has more than 14 clocks, the same word follows again.
void draw_ssi(Wires& wires, std::int64_t period, std::int64_t monoflop, std::int64_t pause, std::size_t clocks,
              unsigned words) {
  for (unsigned word = 0; word < words; ++word) {
    const std::uint32_t position = 17 + 321 * word;
    wires.burst(period, clocks, [&](std::size_t at) {
      const std::size_t place = (at - 1) % (ssi_bits + 1);
      return place < ssi_bits && (position >> (ssi_bits - 1 - place) & 1) != 0;
    });
    wires.wait(monoflop);
    wires.data(true, 0);
    wires.wait(pause);
  }
}

TEST_F(ClockedLines, SsiOfAnyClockMonoflopAndNumberOfClocks) {
  unsigned cells = 0;
  for (const std::int64_t khz : {30, 50, 80, 100, 250, 1000, 2000, 10'000}) {
    const std::int64_t period = 1'000'000 / khz;
    for (const std::int64_t monoflop : {9'000, 12'500, 20'000, 25'000, 41'000, 500'000}) {
      // skips a monoflop time so short that it would elapse between two edges of the clock
      if (monoflop < 6 * period / 10) continue;
      for (const std::size_t clocks : {ssi_bits, ssi_bits + 1, 2 * ssi_bits + 1, 2 * ssi_bits + 2}) {
        for (const std::int64_t pause : {0, 30'000}) {
          ++cells;
          SCOPED_TRACE(std::to_string(khz) + " kHz, monoflop " + std::to_string(monoflop) + " ns, " +
                       std::to_string(clocks) + " clocks, pause " + std::to_string(pause) + " ns");
          Wires wires;
          draw_ssi(wires, period, monoflop, pause, clocks, 20);
          const Rows rows = decode(wires, "ssi", {"bits=13", "after_word=separated"});
          EXPECT_EQ(rows.bad, 0u);
          std::vector<std::uint64_t> expected;
          for (unsigned word = 0; word < 20; ++word) expected.push_back(17 + 321 * word);
          EXPECT_EQ(rows.positions, expected);
          EXPECT_TRUE(notes_.empty());
        }
      }
    }
  }
  EXPECT_GT(cells, 300u);
}

// A word and its repetition belong together, because the monoflop time elapses only after the repetition.
TEST_F(ClockedLines, AMonoflopThatIsOverEndsAWord) {
  Wires wires;
  for (unsigned word = 0; word < 12; ++word) {
    for (unsigned copy = 0; copy < 2; ++copy) {
      wires.burst(5000, ssi_bits + copy,
                  [&](std::size_t at) { return at <= ssi_bits && (0x0AAAu >> (at - 1) & 1) != 0; });
      wires.wait(copy == 0 ? 30'000 : 40'000);
    }
    wires.data(true, 0);
    wires.wait(50'000);
  }
  const Rows rows = decode(wires, "ssi", {"bits=13"});
  EXPECT_TRUE(notes_.empty()) << notes_[0];
  EXPECT_EQ(rows.words, 12u);
}

TEST_F(ClockedLines, TwoWaysToCutAreSaid) {
  Wires wires;
  for (unsigned word = 0; word < 12; ++word) {
    for (unsigned copy = 0; copy < 2; ++copy) {
      wires.burst(5000, ssi_bits + copy, [&](std::size_t at) { return (0x0AAAu >> (at - 1) & 1) != 0; });
      wires.wait(copy == 0 ? 30'000 : 90'000);
    }
  }
  decode(wires, "ssi", {"bits=13"});
  ASSERT_EQ(notes_.size(), 1u);
  EXPECT_NE(notes_[0].find("nothing in a word without a check says which is right"), std::string::npos) << notes_[0];
}

}  // namespace
}  // namespace absenc::client
