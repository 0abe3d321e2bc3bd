// SPDX-License-Identifier: Apache-2.0
// What the identity decides: the format against the options, whether registers may be touched, how long it is itself.
#include <gtest/gtest.h>

#include "absenc/protocol/encolink/bench_test.hpp"
#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::report;

class EncolinkIdentity : public ::testing::TestWithParam<Wire> {
 protected:
  const Wire wire = GetParam();
};
INSTANTIATE_TEST_SUITE_P(Wires, EncolinkIdentity, ::testing::Values(Wire::uart, Wire::spi));

TEST_P(EncolinkIdentity, CountsAgainstTheOptions) {
  Bench bench({.resolution = 17, .multiturn_bits = 0}, wire);
  bench.format = {.resolution = 20, .multiturn_bits = 0};
  const ReadInfo info = bench.conversed<ReadInfo>();
  ASSERT_EQ(info.error(), Error::none) << info.detail();
  EXPECT_EQ(report(info).numbers["resolution"], 17);
  ASSERT_NE(info.reading(), nullptr);
  EXPECT_EQ(info.reading()->singleturn_bits, 17u);
  EXPECT_EQ(info.reading()->multiturn_bits, 0u);
  EXPECT_EQ(report(bench.conversed<Identify>()).numbers["resolution"], 17);
  bench.format = {.resolution = 20, .multiturn_bits = -1};
  const ReadPosition position = bench.conversed<ReadPosition>();
  EXPECT_EQ(position.error(), Error::unexpected_reply);
  EXPECT_NE(position.detail().find("another resolution"), std::string_view::npos);
}

TEST_P(EncolinkIdentity, BitsOfTurnsThatItCannotSayAreTheOptions) {
  Bench bench({.resolution = 20, .multiturn_bits = 12}, wire);
  const ReadInfo info = bench.conversed<ReadInfo>();
  ASSERT_EQ(info.error(), Error::none);
  EXPECT_EQ(info.reading()->multiturn_bits, 12u);
  EXPECT_EQ(info.reading()->multiturn, 7u);
}

TEST_P(EncolinkIdentity, MayHaveAByteBehindIt) {
  for (const Format& told : {Format{}, testing::multi}) {
    Bench bench(testing::multi, wire, {.identity_size = padded_identity_bytes});
    bench.format = told;
    for (int i = 0; i < 3; ++i) {
      const ReadPosition position = bench.conversed<ReadPosition>();
      ASSERT_EQ(position.error(), Error::none) << position.detail();
      EXPECT_EQ(position.position().singleturn, 0x12345u);
      bench.pass(1ms);
    }
    EXPECT_EQ(report(bench.conversed<ReadInfo>()).texts["serial_number"], "AK2A0001");
    bench.pass(1ms);
    EXPECT_EQ(bench.conversed<WriteRegister>(0x04u, std::uint16_t{0}, std::uint64_t{5}).error(), Error::none);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST_P(EncolinkIdentity, OfVersion4LeavesRegistersAlone) {
  Bench bench(testing::multi, wire, {.protocol_version = version::aksim4});
  for (const Format& told : {Format{}, testing::multi}) {
    bench.format = told;
    EXPECT_EQ(bench.conversed<ReadPosition>().error(), Error::none);
    EXPECT_EQ(bench.conversed<ReadDetailedStatus>().error(), Error::none);
    const auto refused = [](const Stream& stream) {
      EXPECT_EQ(stream.error(), Error::unsupported);
      EXPECT_EQ(stream.detail(), not_described);
    };
    refused(bench.conversed<ReadRegister>(0x4Cu));
    refused(bench.conversed<WriteRegister>(0x00u, std::uint16_t{0}, std::uint64_t{5}));
    refused(bench.conversed<Zero>());
    refused(bench.conversed<PresetMultiturn>());
    refused(bench.conversed<SendCommand>(commands::save));
    refused(bench.conversed<SelfCalibrate>());
    const ReadInfo info = bench.conversed<ReadInfo>();
    ASSERT_EQ(info.error(), Error::none) << info.detail();
    EXPECT_EQ(report(info).numbers["protocol_version"], 4);
    EXPECT_EQ(report(info).texts["registers"], not_described);
    EXPECT_EQ(report(info).texts.count("serial_number"), 0u);
  }
  EXPECT_EQ(bench.encoder.memory_version(), 0u);
  EXPECT_EQ(bench.encoder.offset(), 0u);
}

TEST_P(EncolinkIdentity, ThatDoesNotComeMeansThatNothingWasWritten) {
  Bench bench(testing::multi, wire);
  bench.device.set([](unsigned, std::vector<std::uint8_t>& reply) { reply.clear(); });
  const SendCommand save = bench.conversed<SendCommand>(commands::save);
  EXPECT_NE(save.error(), Error::none);
  EXPECT_EQ(save.detail().find("may have been executed"), std::string_view::npos);
}

TEST_P(EncolinkIdentity, FiltersAreKeptAndAnOffsetHasARange) {
  Bench bench(testing::multi, wire);
  for (const std::size_t index : {position_filter, position_filter_speed, velocity_filter, velocity_filter_speed}) {
    const std::uint32_t address = registers[index].address;
    ASSERT_EQ(bench.conversed<WriteRegister>(address, std::uint16_t{0}, 0x1000ull + index).error(), Error::none);
  }
  ASSERT_EQ(bench.conversed<WriteRegister>(0x19u, std::uint16_t{0}, 0x168ull).error(), Error::none);
  ASSERT_EQ(bench.conversed<SendCommand>(commands::save).error(), Error::none);
  bench.encoder.power_off(bench.line.now());
  bench.encoder.power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::skip);
  EXPECT_EQ(report(bench.conversed<ReadRegister>(0x10u)).numbers["velocity_filter_speed"], 0x1004);
  EXPECT_EQ(report(bench.conversed<ReadRegister>(0x19u)).numbers["calibration_range"], 0x168);
  const WriteRegister outside = bench.conversed<WriteRegister>(0x00u, std::uint16_t{0}, 0xFFFFFFFFull);
  EXPECT_EQ(outside.error(), Error::request_rejected);
  EXPECT_EQ(outside.detail(), text_of(AccessStatus::out_of_range));
  EXPECT_EQ(bench.conversed<WriteRegister>(0x1Bu, std::uint16_t{0}, 1ull).error(), Error::request_rejected);

  Bench fraction(testing::multi, wire, {.offset = {.unit = OffsetUnit::turn_fraction}});
  EXPECT_EQ(fraction.conversed<WriteRegister>(0x00u, std::uint16_t{0}, 0xFFFFFFFFull).error(), Error::none);
  EXPECT_EQ(fraction.conversed<Zero>(Offset{.unit = OffsetUnit::turn_fraction}).error(), Error::none);
  EXPECT_EQ(fraction.conversed<ReadPosition>().reading()->singleturn, 0u);
}

}  // namespace
}  // namespace absenc::encolink
