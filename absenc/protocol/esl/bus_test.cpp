// SPDX-License-Identifier: Apache-2.0
// Tests of several ESL encoders on one line.
#include <gtest/gtest.h>

#include <memory>
#include <tuple>

#include "absenc/protocol/esl/bench_test.hpp"
#include "absenc/protocol/esl/host.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;
using testing::Wire;

struct Line8 {
  explicit Line8(const std::vector<std::uint8_t>& addresses) {
    for (const std::uint8_t address : addresses) {
      const auto place = static_cast<std::int64_t>(shafts.size());
      shafts.push_back(std::make_unique<testing::TestShaft>());
      shafts.back()->put(place, place * 1'000'000 + 77);
      encoders.push_back(
          std::make_unique<VirtualEncoder>(Profile{.address = address, .bus = sharing_yes}, *shafts.back()));
      encoders.back()->power_on(Time{}, testing::PowerOn::skip);
      line.attach(sim::NodeRole::device, *encoders.back());
    }
  }
  std::vector<std::unique_ptr<testing::TestShaft>> shafts;
  std::vector<std::unique_ptr<VirtualEncoder>> encoders;
  testing::HostedLine line{LinkKind::half_duplex, line_settings};
};

TEST(EslBus, EachAnswersItsOwnRequests) {
  Line8 bus({0, 1, 2, 3, 4, 5, 6, 7});
  bus.encoders[3]->power_off(Time{});
  for (unsigned round = 0; round < 100; ++round) {
    for (std::uint8_t address = 0; address < most_encoders; ++address) {
      const testing::Talk read(unit, testing::options_of({.address = address}), "position");
      ASSERT_TRUE(bus.line.converse(*read));
      ASSERT_EQ(read->error(), address == 3 ? Error::timeout : Error::none) << round << " " << int{address};
      if (address == 3) continue;
      EXPECT_EQ(read->reading()->singleturn, address * 1'000'000u + 77);
    }
  }
  for (const auto& encoder : bus.encoders) EXPECT_EQ(encoder->violation_count(), 0u);
}

TEST(EslBus, ScanFindsEncodersAndDamagedAnswers) {
  struct Scan final : FieldSink {
    void put(const FieldValue& value) override {
      if (value.info->name == "encoder_address") nodes.push_back(static_cast<int>(value.number));
      if (value.info->name == "clash" && value.number != 0) clashes.push_back(nodes.back());
    }
    std::vector<int> nodes;
    std::vector<int> clashes;
  };
  for (const auto& [there, nodes, clashes] : {std::tuple{Wire{1, 4, 6}, std::vector{1, 4, 6}, std::vector<int>{}},
                                              std::tuple{Wire{1, 4, 4}, std::vector{1, 4}, std::vector{4}},
                                              std::tuple{Wire{}, std::vector<int>{}, std::vector<int>{}}}) {
    Line8 bus(there);
    const testing::Talk made(unit, testing::options_of({}), "scan");
    Conversation<std::uint8_t>& host = *made;
    EXPECT_TRUE(bus.line.converse(host));
    EXPECT_EQ(host.error(), nodes.empty() ? Error::timeout : Error::none);
    Scan found;
    host.report(found);
    EXPECT_EQ(found.nodes, nodes);
    EXPECT_EQ(found.clashes, clashes);
    for (const auto& encoder : bus.encoders) {
      if (clashes.empty()) {
        EXPECT_EQ(encoder->violation_count(), 0u);
      }
      EXPECT_EQ(encoder->answer_count(),
                // the host requests a damaged reply three times
                clashes.empty() || encoder == bus.encoders[0] ? 1u : 3u);
    }
  }
}

// A complete reply with an error comes from one encoder only, so the advice "disconnect one" would be wrong.
TEST(EslBus, RefusalIsNoClash) {
  struct Scan final : FieldSink {
    void put(const FieldValue& value) override {
      if (value.info->role == Role::clash) clash = value.number != 0;
      if (value.info->role == Role::trouble) trouble.assign(value.bytes.begin(), value.bytes.end());
    }
    bool clash = true;
    std::string trouble;
  };
  struct Row {
    Profile encoder;
    std::size_t condition;
    std::int64_t value;
    const char* words;
  };
  for (const Row& row : {Row{{}, condition::ch1_status_set, status::parity_error, "wrong parity bit"},
                         Row{{}, condition::ch1_status_set, status::stop_error, "wrong stop bit"},
                         Row{{}, condition::ch1_status_set, status::channel_2, "says that it is channel 2"},
                         Row{{.status_order = FieldOrder::tformat}, condition::temperature, 35, "channel 2"}}) {
    Bench bench(row.encoder);
    bench.options = testing::options_of({});
    bench.condition(row.condition, row.value);
    if (row.encoder.status_order == FieldOrder::tformat) bench.encoder.raise_alarms(alarms::overspeed);
    const testing::Talk made(unit, bench.options, "scan");
    Conversation<std::uint8_t>& host = *made;
    EXPECT_TRUE(bench.line.converse(host));
    EXPECT_EQ(host.error(), Error::none);
    Scan found;
    host.report(found);
    EXPECT_FALSE(found.clash) << row.words;
    EXPECT_NE(found.trouble.find(row.words), std::string::npos) << found.trouble;
  }
}

}  // namespace
}  // namespace absenc::esl
