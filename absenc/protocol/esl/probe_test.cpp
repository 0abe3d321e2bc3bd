// SPDX-License-Identifier: Apache-2.0
// Tests of the evidence that captured replies give about the profile of their encoder.
#include "absenc/protocol/esl/probe.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include "absenc/protocol/esl/bench_test.hpp"

namespace absenc::esl {
namespace {

using testing::Wire;

struct Taken {
  Wire request;
  Wire reply;
};

// Returns a capture of these requests to a virtual encoder with this profile, and of its replies.
std::vector<Taken> captured(const Profile& profile, const std::vector<Request>& requests) {
  testing::Bench bench(profile);
  bench.shaft.put(77, 0xABCDEF);
  std::vector<Taken> taken;
  for (Request request : requests) {
    request.encoder_address = profile.address;
    taken.push_back({testing::wire_of(request, profile), bench.raw(request)});
  }
  return taken;
}

struct Evidence {
  bool possible = false;
  std::size_t capture = 0;
  std::string why;
};
// Result of a probe: the evidence about each value of each option, and the profile found.
struct Probed final : EvidenceSink {
  explicit Probed(const std::vector<Taken>& taken, bool with_requests = true) {
    std::vector<Capture> captures;
    for (const Taken& one : taken) captures.push_back({with_requests ? Bytes(one.request) : Bytes(), one.reply});
    Options chosen = testing::options_of({});
    any = probe(chosen, captures, *this);
    best = options.format(chosen);
  }
  void put(const OptionEvidence& one) override {
    auto& values = of[options.infos[one.option].name];
    ASSERT_EQ(values.size(), static_cast<std::size_t>(one.value));
    values.push_back({one.possible, one.capture, std::string(one.why)});
  }
  std::ptrdiff_t possible(std::string_view option) {
    return std::count_if(of[option].begin(), of[option].end(), [](const Evidence& one) { return one.possible; });
  }
  bool any = false;
  Profile best{};
  std::map<std::string_view, std::vector<Evidence>> of;
};

const std::vector<Request> everything{{DataId::position},    {DataId::temperature},
                                      {DataId::position},    {DataId::clear_alarms},
                                      {DataId::calibration}, {DataId::write_memory, 0, page_select_address, 8}};

// For each value of each option that the document leaves open: the frames of an encoder with this value must show that
// the value is possible and, if they can show it, that no other value is.
TEST(EslProbe, EveryValueIsFound) {
  for (std::size_t option = 0; option < open_options; ++option) {
    const std::string_view name = options.infos[option].name;
    for (std::size_t value = 0; value < options.infos[option].choices.size(); ++value) {
      // Value `change` of sequence_step is never the only possible one, because the other values are special cases of
      // it.
      if (name == "sequence_step" && value == 0) continue;
      Profile profile{.address = 1};
      options.put(profile, option, static_cast<std::int64_t>(value));
      Probed result(captured(profile, everything));
      SCOPED_TRACE(std::string(name) + "=" + std::string(options.infos[option].choices[value]));
      ASSERT_TRUE(result.any);
      EXPECT_TRUE(result.of[name][value].possible);
      // The value bits_9 of id6_rs is never the only possible one: the nine bits may be the top of sixteen.
      const bool sure = name != "sequence_step" && !(name == "id6_rs" && value == 1);
      if (sure) {
        EXPECT_EQ(options.get(result.best, option), static_cast<std::int64_t>(value));
        EXPECT_EQ(result.of[name][value].why, "only this value explains all frames");
      }
      if (name != "id6_rs" || sure) {
        EXPECT_EQ(result.possible(name), sure ? 1 : 2);
      }
      for (const Evidence& other : result.of[name]) {
        EXPECT_FALSE(other.why.empty());
        EXPECT_LT(other.capture, everything.size());
      }
    }
  }
}

TEST(EslProbe, ReplyAloneShowsCrcAndStatus) {
  const Profile profile{.crc_bit_order = CrcBitOrder::word,
                        .crc16_byte_order = CrcByteOrder::table12,
                        .rs1_sc2 = RedundantBit::b0,
                        .status_order = FieldOrder::tformat};
  Probed result(captured(profile, {{DataId::position}}), false);
  for (const std::string_view name : {"crc_bit_order", "crc16_byte_order", "rs1_sc2", "status_order"}) {
    EXPECT_EQ(result.possible(name), 1) << name;
    EXPECT_EQ(options.get(result.best, options.find(name)), options.get(profile, options.find(name)));
  }
  for (const std::string_view name : {"idc_rs1", "id6_rs", "memory_address_order", "request_crc"}) {
    EXPECT_EQ(result.possible(name), 2) << name;
    EXPECT_EQ(result.of[name][0].why, "these frames do not tell");
  }
}

TEST(EslProbe, EvidenceHasReasonAndCapture) {
  Probed result(captured({.status_order = FieldOrder::tformat}, {{DataId::read_memory, 0, 0x1A}, {DataId::position}}));
  const Evidence& evidence = result.of["status_order"][0];
  EXPECT_FALSE(evidence.possible);
  EXPECT_EQ(evidence.capture, 1u);
  EXPECT_EQ(evidence.why, text_of(Check::stop_reported).sentence);
}

TEST(EslProbe, ReportedParityErrorShowsTheScope) {
  testing::Bench bench({.address = 1});
  const Wire sent = testing::wire(encode_request({.parity_scope = ParityScope::all}, {DataId::position, 1}).view());
  Probed result({{sent, bench.raw(sent)}});
  EXPECT_EQ(result.possible("parity_scope"), 1);
  EXPECT_EQ(result.best.parity_scope, ParityScope::command);
}

TEST(EslProbe, OpenOptionsAreFirst) {
  EXPECT_EQ(open_options, 10u);  // README.md names each of the ten options for properties that the document leaves open
  for (const Option& option : std::span(options.infos).subspan(open_options))
    EXPECT_FALSE(option.probeable) << option.name;
}

TEST(EslProbe, SilenceAndNoiseProveNothing) {
  Probed silence({{Wire{0x08, 0x75}, {}}});
  EXPECT_TRUE(silence.any);
  for (const Option& option : std::span(options.infos).first(open_options)) {
    EXPECT_EQ(silence.possible(option.name), static_cast<std::ptrdiff_t>(option.choices.size()));
  }
  Probed noise({{Wire{0x08, 0x75}, Wire(18, 0x55)}});
  EXPECT_FALSE(noise.any);
  EXPECT_EQ(noise.possible("crc_bit_order"), 0);
}

TEST(EslProbe, OneChangeOrTwoAreFound) {
  const Profile other{.crc16_byte_order = CrcByteOrder::high, .status_order = FieldOrder::tformat};
  const Wire reply = captured(other, {{DataId::position}})[0].reply;
  const auto two = find_change({}, reply);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].option, options.find("crc16_byte_order"));
  EXPECT_EQ(two[1].option, options.find("status_order"));
  const auto one = find_change({.crc16_byte_order = CrcByteOrder::high}, reply);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].option, options.find("status_order"));
  EXPECT_EQ(find_change(other, reply).size(), 0u);
  EXPECT_EQ(find_change({}, {}).size(), 0u);
}

}  // namespace
}  // namespace absenc::esl
