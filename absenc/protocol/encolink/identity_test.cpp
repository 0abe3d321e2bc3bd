// SPDX-License-Identifier: Apache-2.0
// What the identity decides: the format against the options, whether registers may be touched, how long it is itself.
#include <gtest/gtest.h>

#include "absenc/protocol/encolink/bench_test.hpp"
#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::Told;

class EncolinkIdentity : public ::testing::TestWithParam<Wire> {
 protected:
  const Wire wire = GetParam();
};
INSTANTIATE_TEST_SUITE_P(Wires, EncolinkIdentity, ::testing::Values(Wire::uart, Wire::spi));

TEST_P(EncolinkIdentity, CountsAgainstTheOptions) {
  Bench bench({.resolution = 17, .multiturn_bits = 0}, wire);
  bench.tell({.resolution = 20, .multiturn_bits = 0});
  const Told info = bench.run("info");
  ASSERT_EQ(info.error, Error::none) << info.detail;
  EXPECT_EQ(info.numbers.at("resolution"), 17);
  ASSERT_TRUE(info.reading);
  EXPECT_EQ(info.reading->singleturn_bits, 17u);
  EXPECT_EQ(info.reading->multiturn_bits, 0u);
  EXPECT_EQ(bench.run("identify").numbers["resolution"], 17);
  bench.tell({.resolution = 20, .multiturn_bits = -1});
  const Told position = bench.run("position");
  EXPECT_EQ(position.error, Error::unexpected_reply);
  EXPECT_NE(position.detail.find("another resolution"), std::string::npos);
}

TEST_P(EncolinkIdentity, BitsOfTurnsThatItCannotSayAreTheOptions) {
  Bench bench({.resolution = 20, .multiturn_bits = 12}, wire);
  const Told info = bench.run("info");
  ASSERT_EQ(info.error, Error::none);
  EXPECT_EQ(info.reading->multiturn_bits, 12u);
  EXPECT_EQ(info.reading->multiturn, 7u);
}

TEST_P(EncolinkIdentity, MayHaveAByteBehindIt) {
  for (const Format& told : {Format{}, testing::multi}) {
    Format padded = testing::multi;
    padded.identity_size = padded_identity_bytes;
    Bench bench(padded, wire);
    bench.tell(told);
    for (int i = 0; i < 3; ++i) {
      const Told position = bench.run("position");
      ASSERT_EQ(position.error, Error::none) << position.detail;
      EXPECT_EQ(position.reading->singleturn, 0x12345u);
      bench.pass(1ms);
    }
    EXPECT_EQ(bench.run("info").texts["serial_number"], "AK2A0001");
    bench.pass(1ms);
    EXPECT_EQ(bench.run("memory-write", {0x04, 5}).error, Error::none);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST_P(EncolinkIdentity, OfVersion4LeavesRegistersAlone) {
  Format aksim4 = testing::multi;
  aksim4.generation = Generation::aksim4;
  Bench bench(aksim4, wire);
  for (const Format& told : {Format{}, testing::multi}) {
    bench.tell(told);
    EXPECT_EQ(bench.run("position").error, Error::none);
    EXPECT_EQ(bench.run("alarms").error, Error::none);
    const auto refused = [](const Told& told_so) {
      EXPECT_EQ(told_so.error, Error::unsupported);
      EXPECT_EQ(told_so.detail, not_described);
    };
    refused(bench.run("memory-read", {0x4C}));
    refused(bench.run("memory-write", {0x00, 5}));
    refused(bench.run("zero"));
    refused(bench.run("preset-multiturn"));
    refused(bench.run("save"));
    refused(bench.run("self-calibrate"));
    const Told info = bench.run("info");
    ASSERT_EQ(info.error, Error::none) << info.detail;
    EXPECT_EQ(info.numbers.at("protocol_version"), 4);
    EXPECT_EQ(info.texts.at("registers"), not_described);
    EXPECT_EQ(info.texts.count("serial_number"), 0u);
  }
  EXPECT_EQ(bench.encoder.memory_version(), 0u);
  EXPECT_EQ(bench.encoder.offset(), 0u);
}

TEST_P(EncolinkIdentity, ThatDoesNotComeMeansThatNothingWasWritten) {
  Bench bench(testing::multi, wire);
  bench.device.set([](unsigned, std::vector<std::uint8_t>& reply) { reply.clear(); });
  const Told save = bench.run("save");
  EXPECT_NE(save.error, Error::none);
  EXPECT_EQ(save.detail.find("may have been executed"), std::string::npos);
}

TEST_P(EncolinkIdentity, FiltersAreKeptAndAnOffsetHasARange) {
  Bench bench(testing::multi, wire);
  for (const std::size_t index : {position_filter, position_filter_speed, velocity_filter, velocity_filter_speed}) {
    const auto value = static_cast<std::int64_t>(0x1000 + index);
    ASSERT_EQ(bench.run("memory-write", {registers[index].address, value}).error, Error::none);
  }
  ASSERT_EQ(bench.run("memory-write", {0x19, 0x168}).error, Error::none);
  ASSERT_EQ(bench.run("save").error, Error::none);
  bench.restart(Device<std::uint8_t>::PowerOn::skip);
  EXPECT_EQ(bench.run("memory-read", {0x10}).numbers["velocity_filter_speed"], 0x1004);
  EXPECT_EQ(bench.run("memory-read", {0x19}).numbers["calibration_range"], 0x168);
  const Told outside = bench.run("memory-write", {0x00, 0xFFFFFFFF});
  EXPECT_EQ(outside.error, Error::request_rejected);
  EXPECT_EQ(outside.detail, text_of(AccessStatus::out_of_range));
  EXPECT_EQ(bench.run("memory-write", {0x1B, 1}).error, Error::request_rejected);

  Format fractions = testing::multi;
  fractions.offset_unit = OffsetUnit::turn_fraction;
  Bench fraction(fractions, wire);
  EXPECT_EQ(fraction.run("memory-write", {0x00, 0xFFFFFFFF}).error, Error::none);
  EXPECT_EQ(fraction.run("zero").error, Error::none);
  EXPECT_EQ(fraction.run("position").reading->singleturn, 0u);
}

}  // namespace
}  // namespace absenc::encolink
