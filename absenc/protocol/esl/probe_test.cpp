// SPDX-License-Identifier: Apache-2.0
// What captured replies tell about the profile of the encoder that sent them.
#include "absenc/protocol/esl/probe.hpp"

#include <gtest/gtest.h>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/esl/bench_test.hpp"

namespace absenc::esl {
namespace {

using testing::Wire;

struct Taken {
  Wire request;
  Wire reply;
};

// What a sniffer sees when an encoder of this profile is asked for each id.
std::vector<Taken> captured(const Profile& profile, const std::vector<Request>& requests) {
  testing::Bench bench(profile);
  bench.shaft.put(77, 0xABCDEF);
  std::vector<Taken> taken;
  for (Request request : requests) {
    request.encoder_address = profile.address;
    const RequestBytes bytes = encode_request(profile, request);
    taken.push_back({Wire(bytes.view().begin(), bytes.view().end()), bench.raw(request)});
  }
  return taken;
}

ProbeResult probed(const std::vector<Taken>& taken, bool with_requests = true) {
  std::vector<Capture> captures;
  for (const Taken& one : taken) captures.push_back({with_requests ? Bytes(one.request) : Bytes(), one.reply});
  return probe({}, captures);
}

const std::vector<Request> everything{{DataId::position},    {DataId::temperature},
                                      {DataId::position},    {DataId::clear_alarms},
                                      {DataId::calibration}, {DataId::write_memory, 0, page_select_address, 8}};

// Each value of each option is found, and is the only one left, when the frames carry it.
TEST(EslProbe, EveryValueIsFound) {
  for (std::size_t option = 0; option < open_options; ++option) {
    for (std::size_t value = 0; value < options.infos[option].choices.size(); ++value) {
      if (option == option_sequence_step && value == 0) continue;  // change: the others are special cases of it
      Profile profile{.address = 1};
      options.put(profile, option, static_cast<std::int64_t>(value));
      const ProbeResult result = probed(captured(profile, everything));
      SCOPED_TRACE(std::string(options.infos[option].name) + "=" + std::string(options.infos[option].choices[value]));
      ASSERT_GT(result.profiles, 0u);
      EXPECT_TRUE(result.values[option][value].possible);
      if (option == option_sequence_step) {
        EXPECT_EQ(result.possible(option), 2u);
      } else if (option == options.find("id6_rs") && value == 1) {
        EXPECT_TRUE(result.values[option][value].possible);  // nine bits may always be the top of sixteen
      } else {
        EXPECT_EQ(result.possible(option), 1u);
        EXPECT_EQ(options.get(result.best, option), static_cast<std::int64_t>(value));
        EXPECT_EQ(sentence(result, option, value), "only this value explains all frames");
      }
      for (std::size_t other = 0; other < options.infos[option].choices.size(); ++other) {
        if (!result.values[option][other].possible) {
          EXPECT_FALSE(sentence(result, option, other).empty());
          EXPECT_LT(result.values[option][other].capture, everything.size());
        }
      }
    }
  }
}

TEST(EslProbe, AReplyAloneTellsTheCrcAndTheStatus) {
  Profile profile{.crc_bit_order = CrcBitOrder::word,
                  .crc16_byte_order = CrcByteOrder::table12,
                  .rs1_sc2 = RedundantBit::b0,
                  .status_order = FieldOrder::tformat};
  const ProbeResult result = probed(captured(profile, {{DataId::position}}), false);
  for (const std::size_t option : {option_crc_bit_order, options.find("crc16_byte_order"), options.find("rs1_sc2"),
                                   options.find("status_order")}) {
    EXPECT_EQ(result.possible(option), 1u) << options.infos[option].name;
    EXPECT_EQ(options.get(result.best, option), options.get(profile, option));
  }
  for (const std::size_t option :
       {options.find("idc_rs1"), options.find("id6_rs"), options.find("memory_address_order"), option_request_crc}) {
    EXPECT_EQ(result.possible(option), 2u) << options.infos[option].name;
    EXPECT_EQ(sentence(result, option, 0), "these frames do not tell");
  }
}

TEST(EslProbe, TheWhyAndTheWhereAreGiven) {
  std::vector<Taken> taken =
      captured({.status_order = FieldOrder::tformat}, {{DataId::read_memory, 0, 0x1A}, {DataId::position}});
  const ProbeResult result = probed(taken);
  const Evidence& evidence = result.values[options.find("status_order")][0];
  EXPECT_FALSE(evidence.possible);
  EXPECT_EQ(evidence.capture, 1u);
  EXPECT_EQ(evidence.why, Check::stop_reported);
}

TEST(EslProbe, AReportedParityErrorTellsTheScope) {
  testing::Bench bench({.address = 1});
  const RequestBytes request = encode_request({.parity_scope = ParityScope::all, .address = 1}, {DataId::position, 1});
  const Wire sent(request.view().begin(), request.view().end());
  const ProbeResult result = probed({{sent, bench.raw(sent)}});
  EXPECT_EQ(result.possible(option_parity_scope), 1u);
  EXPECT_EQ(result.best.parity_scope, ParityScope::command);
}

TEST(EslProbe, SilenceAndNoiseProveNothing) {
  const ProbeResult silence = probed({{Wire{0x08, 0x75}, {}}});
  EXPECT_GT(silence.profiles, 0u);
  for (std::size_t option = 0; option < open_options; ++option) {
    EXPECT_EQ(silence.possible(option), options.infos[option].choices.size());
  }
  const ProbeResult noise = probed({{Wire{0x08, 0x75}, Wire(18, 0x55)}});
  EXPECT_EQ(noise.profiles, 0u);
  EXPECT_EQ(noise.possible(option_crc_bit_order), 0u);
}

TEST(EslProbe, OneChangeOrTwoAreFound) {
  const std::vector<Taken> taken =
      captured({.crc16_byte_order = CrcByteOrder::high, .status_order = FieldOrder::tformat}, {{DataId::position}});
  const Change two = find_change({}, {.reply = taken[0].reply});
  ASSERT_EQ(two.count, 2u);
  EXPECT_EQ(two.options[0].option, options.find("crc16_byte_order"));
  EXPECT_EQ(two.options[1].option, options.find("status_order"));
  const Change one = find_change({.crc16_byte_order = CrcByteOrder::high}, {.reply = taken[0].reply});
  ASSERT_EQ(one.count, 1u);
  EXPECT_EQ(one.options[0].option, options.find("status_order"));
  EXPECT_EQ(find_change({.crc16_byte_order = CrcByteOrder::high, .status_order = FieldOrder::tformat},
                        {.reply = taken[0].reply})
                .count,
            0u);
  EXPECT_EQ(find_change({}, {}).count, 0u);
}

}  // namespace
}  // namespace absenc::esl
