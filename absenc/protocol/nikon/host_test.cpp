// SPDX-License-Identifier: Apache-2.0
// Tests of readings with a virtual encoder of Nikon's A-format in virtual time.
#include "absenc/protocol/nikon/host.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "absenc/protocol/nikon/bench_test.hpp"

namespace absenc::nikon {
namespace {

using testing::Bench;
using testing::Wire;

ReadPosition& run(Bench& bench, ReadPosition& read) {
  EXPECT_TRUE(bench.line.converse(read));
  return read;
}

TEST(NikonHost, ReadsPositionWithOneRequestInTheTimeOfTheWire) {
  Bench bench;
  bench.shaft.put(4660, 0x12345);
  ReadPosition read({});
  run(bench, read);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(bench.line.now(), frame_pause + 7200ns + answer_time + 4 * 7200ns);
  ASSERT_NE(read.reading(), nullptr);
  EXPECT_EQ(read.reading()->singleturn, 0x12345u);
  EXPECT_EQ(read.reading()->multiturn, 4660u);
  EXPECT_EQ(read.reading()->alarms_reported, alarm::all);
  EXPECT_TRUE(read.reading()->singleturn_valid());
  EXPECT_TRUE(read.reading()->multiturn_valid);
  EXPECT_EQ(read.reading()->latched, frame_pause + 7200ns);
  EXPECT_EQ(read.reading()->received, bench.line.now());
  EXPECT_EQ(bench.device.answer_count(), 1u);
  EXPECT_FALSE(read.last().alarms_read);
}

TEST(NikonHost, ReadsAlarmsWithASecondRequestIfTheStatusIsNotZero) {
  Bench bench;
  bench.shaft.put(4660, 0x12345);
  bench.device.raise_alarms(alarm::battery | alarm::multiturn_error);
  ReadPosition read({});
  run(bench, read);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(bench.device.answer_count(), 2u);
  EXPECT_EQ(bench.line.now(), 2 * (frame_pause + 7200ns + answer_time) + 7 * 7200ns);
  EXPECT_EQ(read.request().code, Code::position);
  EXPECT_EQ(read.last().data & 0xFFFFF, 0x12345u);
  EXPECT_EQ(read.last().alarms_read, alarm::battery | alarm::multiturn_error);
  EXPECT_EQ(read.reading()->singleturn, 0x12345u);
  EXPECT_EQ(read.reading()->singleturn_validity(), Validity::valid);
  EXPECT_EQ(read.reading()->multiturn_validity(), Validity::invalid);
  const auto told = bench.run("position");
  EXPECT_EQ(told.numbers.at("alarms"), alarm::battery | alarm::multiturn_error);
  EXPECT_FALSE(told.numbers.contains("command")) << "two requests have two codes";
  EXPECT_EQ(told.numbers.at("singleturn"), 0x12345);
}

TEST(NikonHost, SecondRequestIsForThePositionAlone) {
  Bench bench;
  bench.device.raise_alarms(alarm::battery);
  for (const auto& [command, answers] : {std::pair{"singleturn", 2u},
                                         {"multiturn", 2u},
                                         {"singleturn-alarms", 1u},
                                         {"singleturn-temperature", 2u},
                                         {"status", 1u},
                                         {"temperature", 1u},
                                         {"identity", 1u},
                                         {"all-positions", 2u}}) {
    const auto told = bench.run(command);
    EXPECT_EQ(told.error, Error::none) << command;
    EXPECT_EQ(told.frames, answers) << command;
  }
  EXPECT_EQ(bench.run("all-positions").reading->singleturn_validity(), Validity::valid) << "one has answered";
  EXPECT_EQ(bench.run("singleturn").numbers.at("alarms"), alarm::battery);
}

TEST(NikonHost, WithoutAlarmsThereIsNoPosition) {
  for (const bool damaged : {false, true}) {
    Bench bench([&](unsigned index, Wire& reply) {
      if (index == 1) damaged ? void(reply[2] ^= 1) : reply.clear();
    });
    bench.device.raise_alarms(alarm::battery);
    ReadPosition read({});
    run(bench, read);
    EXPECT_EQ(read.error(), damaged ? Error::bad_checksum : Error::timeout);
    EXPECT_EQ(read.reading(), nullptr);
  }
}

TEST(NikonHost, TimeoutIsNotRepeated) {
  Bench bench;
  bench.device.power_off(Time{});
  ReadPosition read({});
  EXPECT_EQ(run(bench, read).error(), Error::timeout);
  EXPECT_EQ(bench.line.now(), frame_pause + 7200ns + answer_limit);
}

TEST(NikonHost, ReadsSeveralEncodersWithTheHighestAddress) {
  Bench bench("address=3");
  bench.shaft.put(2, 5);
  const auto told = bench.run("all-positions");
  EXPECT_EQ(told.numbers.at("encoder_address"), 3);
  EXPECT_EQ(told.numbers.at("singleturn"), 5);
  EXPECT_EQ(told.sent, testing::wire(encode_request({}, {.code = Code::all_positions, .address = 7}).view()));
  EXPECT_EQ(bench.run("all-status").numbers.at("alarms"), 0);
}

TEST(NikonHost, Reads17Bits) {
  Bench bench("singleturn_bits=17");
  bench.shaft.put(0, 0xABCDE);
  ReadPosition read({.singleturn_bits = 17}, {.code = Code::short_position});
  run(bench, read);
  EXPECT_EQ(read.reading()->singleturn, 0xABCDEu >> 3);
  EXPECT_TRUE(read.reading()->singleturn_valid());
  ReadPosition part({}, {.code = Code::short_position});
  EXPECT_EQ(run(bench, part).reading(), nullptr) << "a part of 20 bits is no position";
  EXPECT_EQ(part.error(), Error::none);
}

// ---- Places of fields

TEST(NikonPlaces, AreThoseOfOneReplyToAValidRequest) {
  const Options options = author::testing::options_of(unit, "");
  const FieldInfo& singleturn = *std::ranges::find(unit.fields, "singleturn", &FieldInfo::name);
  const auto places = [&](const Wire& request, const Wire& reply) {
    return unit.bits(options, {.bytes = request}, {.bytes = reply}, singleturn).size();
  };
  const Wire request = testing::wire(encode_request({}, {.code = Code::position}).view());
  const Wire reply = testing::wire(encode_reply(Code::position, {}).view());
  EXPECT_GT(places(request, reply), 0u);
  EXPECT_GT(places({}, reply), 0u);
  Wire damaged = request;
  damaged[1] ^= 0x20;
  EXPECT_EQ(places(damaged, reply), 0u);
  const Wire all = testing::wire(encode_request({}, {.code = Code::all_positions, .address = 7}).view());
  const Wire one = testing::wire(encode_reply(Code::all_positions, {}).view());
  Wire two = one;
  two.insert(two.end(), one.begin(), one.end());
  EXPECT_GT(places(all, one), 0u);
  EXPECT_EQ(places(all, two), 0u);
}

// ---- The order of bits that captures show

struct Evidence final : EvidenceSink {
  void put(const OptionEvidence& one) override { all.push_back(one); }
  std::vector<OptionEvidence> all;
};

// Returns the value of the option bit_order that a probe of these captures finds, 0 or 1; -1 if the captures contradict
// both.
std::int64_t probed(std::span<const Capture> captures, Evidence& evidence, std::string_view settings = "") {
  Options options = author::testing::options_of(unit, settings);
  const auto is_order = [](const Option& option) { return option.name == "bit_order"; };
  const auto order =
      static_cast<std::size_t>(std::find_if(unit.options.begin(), unit.options.end(), is_order) - unit.options.begin());
  return unit.probe(options, captures, evidence) ? options[order] : -1;
}

TEST(NikonProbe, WordOfTheTemperatureShowsTheOrderOfBits) {
  const Wire request = testing::wire(encode_request({}, {.code = Code::read_memory, .word = 0xF9}).view());
  const auto reply = [](std::uint64_t word, std::uint64_t address = 0xF9) {
    return testing::wire(encode_reply(Code::read_memory, {.data = word | address << 16}).view());
  };
  struct Row {
    std::uint64_t word;
    std::uint64_t address;
    std::int64_t order;
    bool low, high;
  };
  // A temperature of 35.25 degC is sent as 141 quarters of a degree, 8D (hex).
  for (const Row& row :
       {Row{0x008D, 0xF9, 0, true, false}, Row{0xB100, 0xF9, 1, false, true}, Row{0, 0xF9, 1, true, true},
        Row{0xFFFF, 0xF9, -1, false, false}, Row{0x03C0, 0xF9, 1, true, true}, Row{0x0400, 0xF9, 1, false, true},
        Row{0x0020, 0xF9, 0, true, false}, Row{0xFFFF, 0x12, 1, true, true}}) {
    for (const bool asked : {false, true}) {
      const Wire bytes = reply(row.word, row.address);
      const std::array<Capture, 2> captures{{{}, {asked ? Bytes(request) : Bytes{}, bytes}}};
      Evidence evidence;
      EXPECT_EQ(probed(captures, evidence, "bit_order=high"), row.order) << row.word;
      ASSERT_EQ(evidence.all.size(), 2u);
      EXPECT_EQ(evidence.all[0].possible, row.low) << row.word;
      EXPECT_EQ(evidence.all[1].possible, row.high) << row.word;
      EXPECT_EQ(evidence.all[0].capture, row.low ? 0u : 1u);
    }
  }
  const Wire damaged = [&] {
    Wire bytes = reply(0xFFFF);
    bytes[5] ^= 1;
    return bytes;
  }();
  const Wire position = testing::wire(encode_reply(Code::position, {.data = 0xF9FFFF}).view());
  const std::array<Capture, 3> captures{{{request, damaged}, {{}, position}, {request, {}}}};
  Evidence evidence;
  EXPECT_EQ(probed(captures, evidence, "bit_order=high"), 1) << "no capture shows it";
}

}  // namespace
}  // namespace absenc::nikon
