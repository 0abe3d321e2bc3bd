// SPDX-License-Identifier: Apache-2.0
// Tests the whole path from wires to annotations, for all units that do not use CAN.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/capture/annotate/annotate_frames.hpp"
#include "absenc/capture/annotate/conversation_test.hpp"
#include "absenc/capture/annotate/drawing.hpp"
#include "absenc/capture/files/open.hpp"
#include "absenc/capture/lines/pipeline.hpp"
#include "absenc/os/testing.hpp"
#include "absenc/protocol/all.hpp"
#include "tests/cases.hpp"

namespace absenc::capture {
namespace {

using testing::Talker;
using testing::TalkRecord;

/// Annotations as lines of text; their times are stored apart, because a waveform may round them.
struct Lines final : AnnotationSink {
  void put(const Annotation& one) override {
    std::string line = std::to_string(static_cast<int>(one.kind)) + " " + std::string(text_of(one.error).name) + " ";
    for (const Bytes bytes : {one.request.bytes, one.reply.bytes}) {
      for (const std::uint8_t byte : bytes) {
        line += "0123456789ABCDEF"[byte >> 4];
        line += "0123456789ABCDEF"[byte & 15];
      }
      line += '|';
    }
    if (one.contents.reading != nullptr) line += std::to_string(one.contents.reading->singleturn);
    lines.push_back(line);
    times.push_back(one.begin);
  }
  std::vector<std::string> lines;
  std::vector<Tick> times;
};

std::vector<const Unit*> units_with_wires() {
  std::vector<const Unit*> units;
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::can) units.push_back(unit);
  }
  return units;
}

class WholeWay : public ::testing::TestWithParam<const Unit*> {
 protected:
  const Unit& unit = *GetParam();
  const Options options = testing::options_of(unit);
  const LineSettings line = testing::line_of(unit);
  const bool clocked = host_clocks(unit.link);
  Annotator::Settings settings;

  void SetUp() override {
    settings.ticks = line_ticks(unit, 1e9 / line.rate, 1'000'000'000);
    if (unit.link != LinkKind::full_duplex) return;
    settings.channels = {Carries::requests, Carries::replies};
    settings.channel_count = 2;
  }

  void decode(Reader& reader, Lines& lines) const {
    const auto channel = [&](std::string_view name) {
      const auto& channels = reader.layout().channels;
      const auto found = std::find(channels.begin(), channels.end(), name);
      EXPECT_NE(found, channels.end()) << name;
      return static_cast<unsigned>(found - channels.begin());
    };
    BurstAnnotator bursts(unit, options, lines);
    const auto characters = std::make_unique<Annotator>(unit, options, settings, lines);
    Tick end = 0;
    const PartSink sink = [&](const DecodedPart& part) {
      for (const Burst& burst : part.bursts) bursts.put(burst);
      for (const Character& character : part.characters) characters->put(character);
      end = part.end;
      return true;
    };
    if (clocked) {
      const bool turns = unit.link == LinkKind::clocked_bidirectional;
      ClockedLine wires{.rising = !turns && (line.spi_mode == 0 || line.spi_mode == 3), .low_goes_on = turns};
      const bool spi = unit.link == LinkKind::spi;
      wires.clock = channel(spi ? "sck" : "clock");
      wires.in = channel(spi ? "miso" : "data");
      if (spi) wires.out = channel("mosi");
      if (spi) wires.select = channel("cs");
      EXPECT_EQ(decode_clocked(reader, wires, 1, sink).problem, "");
      return;
    }
    const AsyncSettings each{.baud = static_cast<double>(line.rate),
                             .parity = line.parity,
                             .stop_bits = line.stop_bits,
                             .data_bits = line.data_bits};
    std::vector<AsyncLine> wires;
    if (unit.link == LinkKind::half_duplex) {
      wires = {{channel("line"), each}};
    } else {
      wires = {{channel("host"), each}, {channel("device"), each}};
    }
    EXPECT_EQ(decode_async(reader, wires, 1, sink).problem, "");
    characters->finish(end);
  }

  static std::unique_ptr<Source> source(const std::ostringstream& text) {
    const std::string written = text.str();
    return memory_source({written.begin(), written.end()});
  }

  // Requires that `reader` gives the expected annotations. Their begin times may differ from the expected ones by the
  // duration of one bit.
  void expect_same(Reader& reader, const Lines& expected) {
    const double ticks_per_ns = static_cast<double>(reader.layout().ticks_per_second) / 1e9;
    const LineTicks in_ns = settings.ticks;
    settings.ticks = line_ticks(unit, ticks_per_ns * 1e9 / line.rate, reader.layout().ticks_per_second);
    Lines found;
    decode(reader, found);
    settings.ticks = in_ns;
    ASSERT_EQ(found.lines, expected.lines);
    for (std::size_t i = 0; i < found.times.size(); ++i) {
      // The begin times differ, because a burst begins with chip select or the first clock edge.
      EXPECT_NEAR(static_cast<double>(found.times[i]) / ticks_per_ns, static_cast<double>(expected.times[i]),
                  1e9 / line.rate)
          << expected.lines[i];
    }
    EXPECT_TRUE(reader.damages().empty());
  }
};

TEST_P(WholeWay, EqualsDirectAnnotation) {
  sim::FaultRates faults = sim::testing::damaged_replies(0.02);
  // during a delayed or repeated reply the host would send its next request
  faults[sim::FaultKind::delay] = faults[sim::FaultKind::repeat] = 0;
  faults.character_bytes = static_cast<std::uint8_t>(line.character_bytes());
  Talker talker(unit, options, faults, 7);
  Drawing drawing("capture");
  WaveformSink<sim::Waveform> wires(drawing);
  sim::Waveform waveform(unit.link, line, wires);
  Lines expected;
  BurstAnnotator bursts(unit, options, expected);
  const auto characters = std::make_unique<Annotator>(unit, options, settings, expected);
  static_cast<void>(talker.talk());  // the waveform must begin with a silent line
  talker.draw(waveform);
  std::vector<Character> all;
  const unsigned least = test_cases(300);
  // A command may send few or no characters, so further commands are run until there is an expected annotation or there
  // are 1200 characters.
  for (unsigned i = 0; i < least || (expected.lines.empty() && all.size() < 1200); ++i) {
    const TalkRecord talk = talker.talk();
    ASSERT_FALSE(talk.collided);
    for (const Burst& burst : talk.bursts) bursts.put(burst);
    all.insert(all.end(), talk.characters.begin(), talk.characters.end());
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.begin < b.begin; });
  for (const Character& character : all) characters->put(character);
  characters->finish(talker.now());
  ASSERT_GE(expected.lines.size(), least);

  wires.finish(waveform, std::chrono::microseconds(10));
  std::ostringstream vcd, csv;
  write_vcd(vcd, drawing);
  write_saleae_csv(csv, drawing);
  expect_same(*open_capture(source(vcd), "capture.vcd", {}), expected);
  expect_same(*open_capture(source(csv), "capture.csv", {}), expected);
  const os::testing::TemporaryDirectory directory;
  const std::filesystem::path session = directory.path() / "capture.sr";
  write_sigrok(session, drawing, std::uint64_t{32} * line.rate);
  expect_same(*open_capture(session, {}), expected);
}

INSTANTIATE_TEST_SUITE_P(Units, WholeWay, ::testing::ValuesIn(units_with_wires()), [](const auto& one) {
  std::string name(one.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

}  // namespace
}  // namespace absenc::capture
