// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/hiperface/frame.hpp"
#include "absenc/protocol/hiperface/unit.hpp"

namespace absenc::hiperface {
namespace {

using author::testing::Wire;
using Bench = author::testing::UnitBench<32>;

Wire framed(Wire bytes) {
  bytes.push_back(checksum(bytes));
  return bytes;
}

TEST(HiperfaceDevice, AnswersTheFramesThatOthersPrint) {
  Bench bench(unit, "type=0xFF");
  // this frame is from Nilab's source code
  EXPECT_EQ(bench.raw({0x40, 0x52, 0x12}).reply, (Wire{0x40, 0x52, 0xE4, 0xFF, 0x80, 0x01, 0x88}));
  bench.shaft.put(10, 0x5A5u << 20);
  // this frame is from HPMicro's sample
  EXPECT_EQ(bench.raw({0x40, 0x42, 0x02}).reply, (Wire{0x40, 0x42, 0x00, 0x00, 0xA5, 0xA5, 0x02}));
  EXPECT_EQ(bench.raw({0x40, 0x50, 0x10}).reply, (Wire{0x40, 0x50, 0x00, 0x10}));
  EXPECT_TRUE(bench.raw({0x40, 0x53, 0x13}).reply.empty());
}
TEST(HiperfaceDevice, RepliesAfterItsAnswerTimeAndLaterIfItStores) {
  Bench bench(unit, "");
  const Time character = LineSettings{.rate = 9600, .parity = Parity::even}.character();
  const auto read = bench.raw({0x40, 0x42, 0x02});
  EXPECT_EQ(read.first_byte_at - read.sent_at, answer_time + character);
  const auto stored = bench.raw(framed({0x40, 0x4B, 0, 0, 1, 0x55, 7}), 100ms);
  EXPECT_EQ(stored.reply, framed({0x40, 0x4B, 0, 0, 1}));
  EXPECT_EQ(stored.first_byte_at - stored.sent_at, answer_time + store_time + character);
}
TEST(HiperfaceDevice, IsSilentWhileItStarts) {
  Bench bench(unit, "");
  bench.restart(Bench::PowerOn::real);
  bench.pass(start_time - 50ms);
  EXPECT_TRUE(bench.raw({0x40, 0x42, 0x02}, 20ms).reply.empty());
  bench.pass(50ms);
  EXPECT_FALSE(bench.raw({0x40, 0x42, 0x02}).reply.empty());
}
TEST(HiperfaceDevice, AnswersItsAddressAndBroadcastOnly) {
  Bench bench(unit, "address=0x41");
  EXPECT_TRUE(bench.raw(framed({0x40, 0x42})).reply.empty());
  EXPECT_EQ(bench.raw(framed({0x41, 0x42})).reply.size(), 7u);
  const Wire reply = bench.raw(framed({0xFF, 0x42})).reply;
  ASSERT_EQ(reply.size(), 7u);
  EXPECT_EQ(reply[0], 0x41);
}
TEST(HiperfaceDevice, IgnoresReplyOfAnotherEncoder) {
  Bench bench(unit, "address=0x41");
  // The reply of the encoder with address 40 (hex) has bytes that look like a request to the encoder with address 41
  // (hex).
  Wire both = framed({0x40, 0x42});
  const Wire reply = framed({0x40, 0x42, 0x41, 0x42, 0x03, 0x00});
  both.insert(both.end(), reply.begin(), reply.end());
  EXPECT_TRUE(bench.raw(both).reply.empty());
  EXPECT_EQ(bench.device.answer_count(), 0u);
}
TEST(HiperfaceDevice, RefusesNoByteAndNoRequestToAnotherEncoder) {
  Bench bench(unit, "");
  EXPECT_TRUE(bench.raw({0x40}).reply.empty());
  EXPECT_TRUE(bench.raw(framed({0x41, 0x45})).reply.empty());
  EXPECT_TRUE(bench.raw({0x41, 0x42, 0x00}).reply.empty());
}
TEST(HiperfaceDevice, StoresAtMost25BytesAtOnce) {
  const auto stored = [](std::uint8_t count) {
    Bench bench(unit, "");
    Wire request{0x40, 0x4B, 0, 0, count, 0x55};
    request.resize(request.size() + count, 0x7E);
    return bench.raw(framed(request), 100ms).reply;
  };
  EXPECT_EQ(stored(25), framed({0x40, 0x4B, 0, 0, 25}));
  EXPECT_EQ(stored(26), framed({0x40, 0xD0, refusal::length}));
}
TEST(HiperfaceDevice, AnalogValuesBesideTheTemperatureAreZero) {
  Bench bench(unit, "");
  EXPECT_EQ(bench.raw(framed({0x40, 0x44, 0x01})).reply, framed({0x40, 0x44, 0x01, 0, 0}));
}
TEST(HiperfaceDevice, RefusesFlawedRequestsWithTheirStatusCode) {
  const auto refused = [](Wire request) {
    Bench bench(unit, "");
    const Wire reply = bench.raw(std::move(request), 100ms).reply;
    return reply.size() == 4 && reply[1] == 0xD0 && checksum(reply) == 0 ? reply[2] : 0;
  };
  EXPECT_EQ(refused({0x40, 0x42, 0x03}), refusal::checksum);
  EXPECT_EQ(refused(framed({0x40, 0x45})), refusal::command);
  EXPECT_EQ(refused({0x40, 0x44, 0x48}), refusal::length);
  EXPECT_EQ(refused(framed({0x40, 0x4A, 0, 0, 57, 0x55})), refusal::argument);
  EXPECT_EQ(refused(framed({0x40, 0x4A, 0, 0, 0, 0x55})), refusal::argument);
  EXPECT_EQ(refused(framed({0x40, 0x4A, 0, 0, 57, 0x55})), refusal::argument);
  EXPECT_EQ(refused(framed({0x40, 0x4B, 0xFF, 0, 1, 0x55, 1})), refusal::not_writable);
  EXPECT_EQ(refused(framed({0x40, 0x4A, 0, 0, 1, 0x54})), refusal::access_code);
  EXPECT_EQ(refused(framed({0x40, 0x49, 0x54})), refusal::access_code);
  EXPECT_EQ(refused(framed({0x40, 0x43, 0, 0, 0, 0, 0x54})), refusal::access_code);
  EXPECT_EQ(refused(framed({0x40, 0x43, 1, 0, 0, 0, 0x55})), refusal::argument);
  EXPECT_EQ(refused(framed({0x40, 0x4D, 0, 0xC8, 0x55})), refusal::size_is_fixed);
  EXPECT_EQ(refused(framed({0x40, 0x4D, 2, 0x48, 0x55})), refusal::argument);
  EXPECT_EQ(refused(framed({0x40, 0x4D, 2, 0xC8, 0x54})), refusal::access_code);
  EXPECT_EQ(refused(framed({0x40, 0x4D, 14, 0xC8, 0x55})), refusal::no_field);
  EXPECT_EQ(refused(framed({0x40, 0x4A, 0, 127, 2, 0x55})), refusal::outside);
  EXPECT_EQ(refused(framed({0x40, 0x4A, 2, 0, 1, 0x55})), refusal::no_field);
  EXPECT_EQ(refused(framed({0x40, 0x4F, 4, 0x55, 0x55})), refusal::argument);
  EXPECT_EQ(refused(framed({0x40, 0x4F, 1, 0x54, 0x55})), refusal::access_code);
  EXPECT_EQ(refused(framed({0x40, 0x55, 0x60, 0x55})), refusal::argument);
  EXPECT_EQ(refused(framed({0x40, 0x55, 0x41, 0x54})), refusal::access_code);
  EXPECT_EQ(refused(framed({0x40, 0x57, 0xE7, 0x55})), refusal::argument);
  EXPECT_EQ(refused(framed({0x40, 0x57, 0xE5, 0x54})), refusal::access_code);
  EXPECT_EQ(refused(framed({0x40, 0x42})), 0);
}
TEST(HiperfaceDevice, RefusesCharacterWithWrongParity) {
  Bench bench(unit, "");
  // If the host sends at another baud rate, its characters arrive damaged.
  const std::array<std::uint8_t, 1> address{0x40};
  bench.device.feed({.kind = ByteEvent::Kind::received, .at = bench.line.now(), .items = address});
  bench.device.feed({.kind = ByteEvent::Kind::line_error, .at = bench.line.now() + 1ms});
  bench.device.feed({.kind = ByteEvent::Kind::silence, .at = bench.line.now() + 10ms});
  const ByteStep step = bench.device.next(bench.line.now() + 10ms);
  ASSERT_EQ(step.kind, ByteStep::Kind::transfer);
  EXPECT_EQ(Wire(step.out.begin(), step.out.end()), framed({0x40, 0xD0, refusal::parity}));
}
TEST(HiperfaceDevice, CreatesDataFieldsUntilMemoryIsFull) {
  Bench bench(unit, "");
  for (std::uint8_t field = 2; field < user_fields; ++field) {
    EXPECT_EQ(bench.raw(framed({0x40, 0x4D, field, 0xCF, 0x55}), 100ms).reply, framed({0x40, 0x4D, field, 0xCF}));
  }
  EXPECT_EQ(bench.raw(framed({0x40, 0x4E})).reply, framed({0x40, 0x4E, 0}));
  EXPECT_EQ(bench.raw(framed({0x40, 0x4A, 13, 127, 1, 0x55})).reply.size(), 7u);
}
TEST(HiperfaceDevice, StartsWithMemoryOfAnyContent) {
  Bench bench(unit, "");
  bench.device.power_off(bench.line.now());
  for (std::uint8_t& byte : bench.device.memory()) byte = 0xFF;
  // stores an interface setting with a code of a baud rate that does not exist
  bench.device.memory()[1] = interface_at_shipping ^ 0xE7;
  bench.device.power_on(bench.line.now(), Bench::PowerOn::skip);
  EXPECT_EQ(bench.raw(framed({0xFF, 0x52})).reply.size(), 7u);
  EXPECT_EQ(bench.raw(framed({0xFF, 0x4E})).reply.size(), 4u);
}
TEST(HiperfaceDevice, ReportsAlarmsInTurn) {
  Bench bench(unit, "");
  bench.device.raise_alarms(alarm_of(0x1D) | alarm_of(0x01));
  for (const std::uint8_t code : std::to_array<std::uint8_t>({0x01, 0x1D, 0x01})) {
    EXPECT_EQ(bench.raw({0x40, 0x50, 0x10}).reply, framed({0x40, 0xD0, code}));
  }
  bench.device.lower_alarms(alarm_of(0x01));
  EXPECT_EQ(bench.raw({0x40, 0x50, 0x10}).reply, framed({0x40, 0xD0, 0x1D}));
}
TEST(HiperfaceDevice, NewInterfaceSettingHoldsAfterReplyAndPowerOff) {
  Bench bench(unit, "");
  EXPECT_EQ(bench.raw(framed({0x40, 0x57, 0xE5, 0x55}), 100ms).reply, framed({0x40, 0x57, 0xE5}));
  EXPECT_TRUE(bench.raw({0x40, 0x42, 0x02}).reply.empty());
  bench.restart();
  EXPECT_TRUE(bench.raw({0x40, 0x42, 0x02}).reply.empty());
}

}  // namespace
}  // namespace absenc::hiperface
