// SPDX-License-Identifier: Apache-2.0
// Checks that a life counter that stands still is an error.
#include "absenc/client/encoder/connection.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/port/virtual_link_test.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

/// Stores whether a reading reports a life counter.
class Seen final : public FieldSink {
 public:
  void put(const FieldValue& field) override { any = any || field.info->role == Role::life_counter; }
  bool any = false;
};

/// A machine that stands between host and encoder and can repeat old frames of the encoder.
class Recorder final : public Machine<std::uint8_t> {
 public:
  explicit Recorder(Machine<std::uint8_t>& encoder) : encoder_(&encoder) {}
  void play(std::vector<std::size_t> frames) { played_ = std::move(frames); }
  [[nodiscard]] std::size_t left() const { return played_.size(); }

  void feed(const ByteEvent& event) override { encoder_->feed(event); }
  ByteStep next(Time now) override {
    ByteStep step = encoder_->next(now);
    if (step.kind != ByteStep::Kind::transfer) return step;
    if (played_.empty()) {
      frames_.emplace_back(step.out.begin(), step.out.end());
      return step;
    }
    step.out = frames_.at(played_.front());
    played_.erase(played_.begin());
    return step;
  }

 private:
  Machine<std::uint8_t>* encoder_;
  std::vector<std::vector<std::uint8_t>> frames_;
  std::vector<std::size_t> played_;
};

struct Counting {
  explicit Counting(const Unit& unit)
      : address(parse_address("sim:" + std::string(unit.id))),
        encoder(*address.unit, address.options, address.device),
        recorder(*encoder.bytes()),
        connection(Connection::make(address, [this](const EncoderAddress& to) {
          Link link;
          put_on_line<std::uint8_t>(link, to, recorder);
          return link;
        })) {
    encoder.power_on(Time{});
    connection->connect();
    // The recorder numbers frames from 0: the first reading has frames 0 and 1.
    first = connection->read();
    connection->report(seen);
  }
  EncoderAddress address;
  VirtualDevice encoder;
  Recorder recorder;
  std::unique_ptr<Connection> connection;
  Outcome first;
  Seen seen;
};

class LifeCounters : public ::testing::TestWithParam<const Unit*> {};

std::vector<const Unit*> units_that_count() {
  std::vector<const Unit*> counting;
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::clocked) continue;
    if (Counting(*unit).seen.any) counting.push_back(unit);
  }
  return counting;
}

TEST_P(LifeCounters, OneThatStandsStillIsAnError) {
  Counting line(*GetParam());
  ASSERT_EQ(line.first.error, Error::none);
  EXPECT_EQ(line.connection->read().error, Error::none);
  const std::uint64_t good = line.connection->counters().good;
  line.recorder.play({0, 1, 0, 1, 0, 1, 0, 1});
  EXPECT_EQ(line.connection->read().error, Error::none) << "it may have come round";
  const Outcome stands = line.connection->read();
  EXPECT_EQ(stands.error, Error::sequence_mismatch);
  EXPECT_EQ(stands.reading, nullptr);
  EXPECT_NE(line.connection->trouble(stands).message.find("stands still"), std::string::npos);
  EXPECT_EQ(line.recorder.left(), 2u);
  EXPECT_EQ(line.connection->counters().errors[static_cast<std::size_t>(Error::sequence_mismatch)], 1u);
  EXPECT_EQ(line.connection->counters().good, good + 2);
}

TEST_P(LifeCounters, OneThatHasComeRoundIsReadAgain) {
  Counting line(*GetParam());
  for (int i = 0; i < 2; ++i) EXPECT_EQ(line.connection->read().error, Error::none);
  // the second reading repeats the life counter, as if it had wrapped, so the encoder is read again
  line.recorder.play({0, 1, 0, 1, 2, 3, 0, 1});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(line.connection->read().error, Error::none);
  EXPECT_EQ(line.recorder.left(), 0u);
}

INSTANTIATE_TEST_SUITE_P(Units, LifeCounters, ::testing::ValuesIn(units_that_count()), [](const auto& one) {
  std::string name(one.param->id);
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
});

TEST(LifeCountersOfUnits, AreSomewhere) { EXPECT_FALSE(units_that_count().empty()); }

}  // namespace
}  // namespace absenc::client
