// SPDX-License-Identifier: Apache-2.0
// Checks that doctor judges each request, not only each reading: repeated requests, replies after a later request, and
// silence at the beginning.
#include <gtest/gtest.h>

#include "absenc/client/doctor/observed_test.hpp"

namespace absenc::client {
namespace {

constexpr std::size_t many = 60;

Attempted silence(const ByteList& request = {0x1A}) {
  Attempted one{.error = Error::timeout};
  one.exchange.request.bytes = request;
  one.limit = 40ms;
  return one;
}

Attempted reply(const ByteList& bytes, const ByteList& request = {0x1A}, Error error = Error::none) {
  Attempted one = silence(request);
  one.error = error;
  one.heard = one.answered = true;
  one.exchange.reply.bytes = one.raw = bytes;
  return one;
}

std::string first_of(const Examination& examination) {
  const Finding* first = examination.first();
  return first == nullptr ? "good" : std::string(first->id);
}

Observations good_readings() {
  Observations seen;
  for (std::size_t i = 0; i < many; ++i) seen.readings.push_back(reply(good_reply()));
  return seen;
}

TEST(DoctorExchanges, RequestsThatReadingsRepeatedAreSilence) {
  Observations seen = good_readings();
  EXPECT_EQ(first_of(judged(seen)), "good");
  for (std::size_t i = 0; i < many; ++i) {
    if (i % 10 == 0) seen.exchanges.push_back(silence());
    seen.exchanges.push_back(seen.readings[i]);
  }
  const Examination examination = judged(seen);
  ASSERT_EQ(first_of(examination), "sometimes_silent");
  EXPECT_EQ(examination.findings.front().evidence, "6 of 66 requests were not answered");
}

TEST(DoctorExchanges, SilenceAtFirstIsStarting) {
  Observations seen = good_readings();
  seen.readings.insert(seen.readings.begin(), 3, silence());
  EXPECT_EQ(first_of(judged(seen)), "starting");
}

TEST(DoctorExchanges, SilenceAtFirstProvesNothingBesideFewReadings) {
  Observations seen = good_readings();
  seen.readings.resize(4);
  seen.readings.insert(seen.readings.begin(), 3, silence());
  EXPECT_EQ(first_of(judged(seen)), "sometimes_silent");
}

TEST(DoctorExchanges, SilenceThatComesAgainIsNoStart) {
  Observations seen = good_readings();
  seen.readings.insert(seen.readings.begin(), 3, silence());
  seen.readings.insert(seen.readings.begin() + 30, silence());
  EXPECT_EQ(first_of(judged(seen)), "sometimes_silent");
}

TEST(DoctorExchanges, EchoWithoutReplyIsSilence) {
  Observations seen = good_readings();
  for (std::size_t i = 5; i < many; i += 10) {
    seen.readings[i] = silence();
    seen.readings[i].heard = true;
    seen.readings[i].raw = {0x1A};
  }
  EXPECT_EQ(first_of(judged(seen)), "sometimes_silent");
}

TEST(DoctorExchanges, ReplyBehindLaterRequestIsLate) {
  const EncoderAddress address = parse_address("sim:e201");
  const auto bytes = [](std::string_view text) { return ByteList(text.begin(), text.end()); };
  const ByteList position = bytes("c41b04fd80000000\r");
  const ByteList version = bytes("E201-9S V1.16\r");
  ByteList both = version;
  both.insert(both.end(), position.begin(), position.end());
  Observations seen;
  for (std::size_t i = 0; i < many; ++i) {
    if (i % 10 == 5) {
      seen.readings.push_back(silence({'4'}));
      seen.readings.push_back(reply(both, {'v'}, Error::wrong_length));
      seen.readings.back().began = 90ms;
      seen.readings.back().after = 30ms;
    } else {
      seen.readings.push_back(reply(position, {'4'}));
    }
  }
  const Examination examination = judge(*address.unit, address.options, seen);
  EXPECT_EQ(first_of(examination), "sometimes_late") << examination.verdict();
  ASSERT_FALSE(examination.findings.empty());
  EXPECT_NE(examination.findings.front().evidence.find("120 ms"), std::string::npos);
}

}  // namespace
}  // namespace absenc::client
