// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/frame.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "absenc/core/hex.hpp"

namespace absenc::tformat {
namespace {

constexpr std::array all_ids{DataId::singleturn, DataId::multiturn,       DataId::encoder_id,
                             DataId::everything, DataId::write_memory,    DataId::clear_alarms,
                             DataId::zero,       DataId::reset_multiturn, DataId::read_memory};

TEST(TformatFrame, ControlFieldsOfTable1) {
  const std::array<std::uint8_t, 9> table{0x02, 0x8A, 0x92, 0x1A, 0x32, 0xBA, 0xC2, 0x62, 0xEA};
  for (std::size_t i = 0; i < all_ids.size(); ++i) EXPECT_EQ(control_field(all_ids[i]), table[i]);
}

TEST(TformatFrame, ChecksumIsTheCrcOfTheSpecification) {
  std::vector<std::uint8_t> bytes;
  for (unsigned i = 0; i < 64; ++i) {
    EXPECT_EQ(checksum(bytes), crc_bitwise(crc_parameters, bytes));
    bytes.push_back(static_cast<std::uint8_t>(i * 73 + 19));
  }
}

TEST(TformatFrame, EveryControlFieldIsJudged) {
  for (unsigned field = 0; field < 256; ++field) {
    const std::array<std::uint8_t, 1> bytes{static_cast<std::uint8_t>(field)};
    const Result<Request> request = decode_request(bytes);
    if ((field & 7) != 2) {
      EXPECT_EQ(request.error(), Error::bad_framing);
    } else if (bytes[0] != control_field(bytes[0] >> 3)) {
      EXPECT_EQ(request.error(), Error::bad_checksum) << field;
    } else if (!data_id(bytes[0])) {
      EXPECT_EQ(request.error(), Error::unsupported) << field;
    } else if (is_memory_access(*data_id(bytes[0]))) {
      EXPECT_EQ(request.error(), Error::wrong_length) << field;
    } else {
      EXPECT_TRUE(request.has_value()) << field;
    }
  }
}

TEST(TformatFrame, TwoBitErrorsThatPassEachLevelOfChecks) {
  const Format format{.encoder_id = 0x11};
  const ReplyBytes good = encode_reply({.singleturn = 0x12345, .multiturn = 0x1234, .encoder_id = 0x11});
  unsigned crc_passes = 0;
  unsigned lax_passes = 0;
  unsigned strict_passes = 0;
  unsigned pairs = 0;
  for (unsigned a = 0; a < 88; ++a) {
    for (unsigned b = a + 1; b < 88; ++b) {
      ReplyBytes bad = good;
      bad[a / 8] ^= static_cast<std::uint8_t>(1u << a % 8);
      bad[b / 8] ^= static_cast<std::uint8_t>(1u << b % 8);
      ++pairs;
      const Error error = decode_reply(format, {DataId::everything}, bad).error();
      if (error != Error::bad_checksum) ++crc_passes;
      if (error == Error::none) ++strict_passes;
      // `lax_passes` counts the two-bit errors that neither the CRC nor the other checks detect, if these ignore the
      // upper four bits of the status field (SF) and compare no redundant values.
      bad[1] &= 0x0F;
      bad[10] = checksum(bad.view().first(10));
      const Error fixed_bits = decode_reply(format, {DataId::everything}, bad).error();
      const bool passes = fixed_bits == Error::none || fixed_bits == Error::cross_check_failed;
      if (error != Error::bad_checksum && passes) ++lax_passes;
    }
  }
  EXPECT_EQ(pairs, 3828u);
  EXPECT_EQ(crc_passes, 440u);
  EXPECT_EQ(lax_passes, 150u);
  EXPECT_EQ(strict_passes, 102u);
}

TEST(TformatFrame, RefusalDiffersFromWrongLength) {
  const ReplyBytes refusal = encode_reply({.status = status::parity_error, .encoder_id = 0x11});
  EXPECT_EQ(decode_reply({}, {DataId::singleturn}, refusal).error(), Error::request_rejected);
  EXPECT_EQ(decode_reply({}, {DataId::everything}, refusal).error(), Error::request_rejected);
  EXPECT_EQ(decode_reply({}, {DataId::singleturn}, refusal.view().first(6)).error(), Error::wrong_length);
  ReplyBytes damaged = refusal;
  damaged[4] ^= 1;
  EXPECT_EQ(decode_reply({}, {DataId::singleturn}, damaged).error(), Error::bad_checksum);
}

// Replies to a request that writes a memory byte (Table 5, 9.1).
TEST(TformatFrame, MemoryReplyMatchesItsRequest) {
  const Request write{DataId::write_memory, 5, 7};
  const auto answered = [&write](std::uint8_t address, bool busy, std::uint8_t value, bool strict = true) {
    const Reply reply{.id = write.id, .address = address, .busy = busy, .value = value};
    return decode_reply({.strict = strict}, write, encode_reply(reply)).error();
  };
  EXPECT_EQ(answered(5, false, 7), Error::none);
  EXPECT_EQ(answered(6, false, 7), Error::unexpected_reply);
  EXPECT_EQ(answered(5, false, 8), Error::unexpected_reply);
  EXPECT_EQ(answered(5, true, 0), Error::none);
  EXPECT_EQ(answered(5, true, 1), Error::unexpected_reply);
  EXPECT_EQ(answered(5, true, 1, false), Error::none);
}

TEST(TformatFrame, RefusesInvalidRequests) {
  EXPECT_EQ(decode_request({}).error(), Error::wrong_length);
  // request with the busy bit, which only replies may have
  EXPECT_EQ(decode_request(hex<"328100B3">).error(), Error::out_of_range);
  EXPECT_TRUE(decode_request(hex<"32010033">));
}

// Checks that each alarm makes the parts of a reading invalid that paragraph 6.5 states.
TEST(TformatFrame, ValidityOfEachPart) {
  struct Row {
    std::uint8_t almc;
    unsigned singleturn_valid_bits;
    bool multiturn_valid;
  };
  for (const Row& row :
       {Row{0, 17, true}, Row{alarms::over_speed, 17, false}, Row{alarms::full_absolute_status, 5, true},
        Row{alarms::counting_error, 0, true}, Row{alarms::counter_overflow, 17, true}, Row{alarms::over_heat, 17, true},
        Row{alarms::multiturn_error, 17, false}, Row{alarms::battery_error, 17, false},
        Row{alarms::battery_alarm, 17, true}, Row{alarms::battery_error | alarms::battery_alarm, 17, false}}) {
    const Reading reading = to_reading({}, {.status = status_for(row.almc), .alarms = row.almc});
    EXPECT_EQ(reading.singleturn_valid_bits, row.singleturn_valid_bits) << int{row.almc};
    EXPECT_EQ(reading.multiturn_valid, row.multiturn_valid) << int{row.almc};
    EXPECT_EQ(reading.singleturn_valid(), row.singleturn_valid_bits == 17);
  }
}

TEST(TformatFrame, PartialRepliesLeaveValidityUnknown) {
  const Reply part{.id = DataId::singleturn, .singleturn = 77};
  EXPECT_EQ(to_reading({}, part).singleturn_valid_bits, 5u);
  EXPECT_EQ(to_reading({}, part).singleturn_validity(), Validity::unknown);
  EXPECT_EQ(to_reading({.singleturn_bits = 5}, part).singleturn_validity(), Validity::valid);
  EXPECT_EQ(to_reading({}, part, alarms::full_absolute_status).singleturn_validity(), Validity::invalid);
  EXPECT_EQ(to_reading({}, part, 0).singleturn_valid_bits, 17u);
  EXPECT_EQ(to_reading({}, part).multiturn_bits, 0u);
  const Reply turns{.id = DataId::multiturn, .multiturn = 5};
  EXPECT_FALSE(to_reading({}, turns).multiturn_valid);
  EXPECT_TRUE(to_reading({}, turns, 0).multiturn_valid);
  EXPECT_FALSE(to_reading({}, turns, alarms::over_speed).multiturn_valid);
  EXPECT_EQ(to_reading({}, turns).multiturn_validity(), Validity::unknown);
  EXPECT_EQ(to_reading({}, turns, alarms::over_speed).multiturn_validity(), Validity::invalid);
  const Reply alarmed{.id = DataId::multiturn, .status = status::alarm, .multiturn = 5};
  EXPECT_FALSE(to_reading({}, alarmed, 0).multiturn_valid);
  EXPECT_EQ(to_reading({}, alarmed, 0).multiturn_validity(), Validity::unknown);
}

// The status bit `alarm` stands for four alarms; if one of them is known to be raised, it explains the bit.
TEST(TformatFrame, KnownAlarmExplainsStatus) {
  const Reply turns{.id = DataId::multiturn, .status = status::alarm, .multiturn = 5};
  for (const std::uint8_t harmless : {alarms::over_heat, alarms::battery_alarm}) {
    EXPECT_EQ(to_reading({}, turns, harmless).multiturn_validity(), Validity::valid) << int{harmless};
    EXPECT_EQ(to_reading({}, turns, harmless).alarms, harmless);
    EXPECT_EQ(to_reading({}, turns, harmless).alarms_reported, 0xFFu);
  }
  EXPECT_EQ(to_reading({}, turns, alarms::battery_error).multiturn_validity(), Validity::invalid);
}

// The status field (SF) has one bit for counting_error, and one common bit for four other alarms (6.3.2).
TEST(TformatFrame, StatusReportsPartOfTheAlarms) {
  constexpr std::uint8_t in_status = alarms::counting_error | alarms::shown_in_status;
  struct Row {
    std::uint8_t status;
    std::uint8_t reported;
    std::uint8_t raised;
  };
  for (const DataId id :
       {DataId::singleturn, DataId::multiturn, DataId::clear_alarms, DataId::zero, DataId::reset_multiturn}) {
    for (const Row& row :
         {Row{0, in_status, 0}, Row{status::counting_error, in_status, alarms::counting_error},
          Row{status::alarm, alarms::counting_error, 0},
          Row{status::alarm | status::counting_error, alarms::counting_error, alarms::counting_error}}) {
      const Reading reading = to_reading({}, {.id = id, .status = row.status});
      EXPECT_EQ(reading.alarms_reported, row.reported) << static_cast<int>(id) << " " << int{row.status};
      EXPECT_EQ(reading.alarms, row.raised) << static_cast<int>(id) << " " << int{row.status};
      EXPECT_EQ(reading.status_reported, 0xFFu);
    }
  }
  EXPECT_EQ(to_reading({}, {.id = DataId::everything}).alarms_reported, 0xFFu);
  EXPECT_EQ(to_reading({}, {.id = DataId::read_memory}).status_reported, 0u);
}

// Without a battery the bit `alarm` of the status field is always set (paragraph 2 (1)).
TEST(TformatFrame, WithoutBatteryStatusLeavesFourAlarmsUnknown) {
  constexpr Format format{.battery = false};
  const auto whole = [&](std::uint8_t more) {
    const auto almc = static_cast<std::uint8_t>(alarms::without_battery | more);
    return to_reading(format, {.id = DataId::everything, .status = status_for(almc), .alarms = almc});
  };
  EXPECT_EQ(whole(0).alarms_reported, 0xFFu ^ alarms::without_battery);
  EXPECT_EQ(whole(0).status, 0u);
  EXPECT_EQ(whole(0).status_reported, 0xFFu);
  EXPECT_EQ(whole(alarms::over_heat).status, unsigned{status::alarm});
  const Reading part = to_reading(format, {.id = DataId::singleturn, .status = status::alarm});
  EXPECT_EQ(part.status_reported, 0xFFu ^ status::alarm);
  EXPECT_EQ(part.alarms_reported, unsigned{alarms::counting_error});
  EXPECT_EQ(remembered(whole(alarms::over_heat), part).alarms, unsigned{alarms::over_heat});
  EXPECT_EQ(remembered(whole(0), part).alarms_reported, 0xFFu ^ alarms::without_battery);
  EXPECT_EQ(remembered(whole(0), part).singleturn_validity(), Validity::valid);
  EXPECT_EQ(remembered(part, whole(0)).alarms_reported, whole(0).alarms_reported);
}

// Checks the alarms that a reader of captures knows after each of several replies.
TEST(TformatFrame, LaterRepliesCompleteWhatEarlierOnesReported) {
  const auto part = [](std::uint8_t sf) { return to_reading({}, {.id = DataId::singleturn, .status = sf}); };
  const auto whole = [](std::uint8_t almc) {
    return to_reading({}, {.id = DataId::everything, .status = status_for(almc), .alarms = almc});
  };
  EXPECT_EQ(remembered({}, part(0)).singleturn_validity(), Validity::unknown);
  const Reading clear = remembered(whole(0), part(0));
  EXPECT_EQ(clear.singleturn_validity(), Validity::valid);
  EXPECT_EQ(clear.alarms_reported, 0xFFu);
  const Reading one_of_four = remembered(clear, part(status::alarm));
  EXPECT_EQ(one_of_four.singleturn_validity(), Validity::valid);
  EXPECT_EQ(one_of_four.alarms_reported, 0xFFu ^ alarms::shown_in_status);
  EXPECT_EQ(remembered(one_of_four, part(status::alarm)).alarms_reported, one_of_four.alarms_reported);
  EXPECT_EQ(remembered(one_of_four, part(0)).alarms_reported, 0xFFu);
  const Reading coarse = remembered(whole(alarms::full_absolute_status | alarms::over_heat), part(status::alarm));
  EXPECT_EQ(coarse.singleturn_validity(), Validity::invalid);
  EXPECT_EQ(coarse.alarms, alarms::full_absolute_status | alarms::over_heat);
  EXPECT_EQ(remembered(coarse, part(0)).alarms, alarms::full_absolute_status);
  EXPECT_EQ(remembered(coarse, whole(0)).alarms, 0u);
}

}  // namespace
}  // namespace absenc::tformat
