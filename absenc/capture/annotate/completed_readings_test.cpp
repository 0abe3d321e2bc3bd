// SPDX-License-Identifier: Apache-2.0
// Tests that alarms of one reply complete later readings, with frames of Nikon's A-format.
#include <gtest/gtest.h>

#include <optional>

#include "absenc/capture/annotate/completed_readings.hpp"
#include "absenc/capture/annotate/conversation_test.hpp"
#include "absenc/capture/annotate/judge.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::capture {
namespace {

// The status bit in the reply with a position only shows that there is an alarm, but not which.
constexpr auto read_0 = hex<"0200">;
constexpr auto position_0 = hex<"04004523710000fe">;
constexpr auto position_0_with_status = hex<"04104523710000ae">;
constexpr auto read_5 = hex<"a280">;
constexpr auto position_5_with_status = hex<"2c104523710000a5">;
constexpr auto read_alarms_0 = hex<"0223">;
constexpr auto battery_0 = hex<"c410010000c4">;
constexpr auto singleturn_error_0 = hex<"c410200000a7">;
constexpr auto read_all_alarms = hex<"e267">;
constexpr auto battery_0_multiturn_error_5 = hex<"c41101000068ec11020000b7">;
constexpr auto clear_0 = hex<"0268">;
constexpr auto battery_before_clearing = hex<"041201000090">;

class CompletedReadingsByAlarms : public ::testing::Test, private AnnotationSink {
 protected:
  // Returns the completed reading of a good exchange; nothing if the exchange has none.
  std::optional<Reading> after(Bytes request, Bytes reply) {
    Judge judge(unit_, options_);
    EXPECT_EQ(judge.decode({.bytes = request}, {.bytes = reply}), Error::none);
    readings_.put({.kind = Annotation::Kind::exchange,
                   .request = {.bytes = request},
                   .reply = {.bytes = reply},
                   .contents = judge.contents()});
    return last_;
  }
  Reading position_after(Bytes request, Bytes reply) { return after(request, reply).value_or(Reading{}); }

 private:
  void put(const Annotation& one) override {
    last_.reset();
    if (one.contents.reading != nullptr) last_ = *one.contents.reading;
  }

  const Unit& unit_ = *find_unit("nikon");
  Options options_ = testing::options_of(unit_);
  CompletedReadings readings_{unit_, options_, *this};
  std::optional<Reading> last_{};
};

TEST_F(CompletedReadingsByAlarms, CompletesLaterReadings) {
  EXPECT_EQ(position_after(read_0, position_0_with_status).singleturn_validity(), Validity::unknown);
  EXPECT_FALSE(after(read_alarms_0, battery_0).has_value());
  const Reading battery = position_after(read_0, position_0_with_status);
  EXPECT_EQ(battery.alarms, 1u);
  EXPECT_EQ(battery.alarms_reported, 0x7FFu);
  EXPECT_EQ(battery.singleturn_validity(), Validity::valid);
  after(read_alarms_0, singleturn_error_0);
  EXPECT_EQ(position_after(read_0, position_0_with_status).singleturn_validity(), Validity::invalid);
  EXPECT_EQ(position_after(read_0, position_0).alarms, 0u) << "a status of 0 reports that no alarm is raised";
  EXPECT_EQ(position_after(read_0, position_0_with_status).singleturn_validity(), Validity::unknown);
}

TEST_F(CompletedReadingsByAlarms, BelongToTheirEncoder) {
  after(read_alarms_0, battery_0);
  EXPECT_EQ(position_after(read_5, position_5_with_status).singleturn_validity(), Validity::unknown);
  EXPECT_EQ(position_after(read_0, position_0_with_status).alarms, 1u);
  after(read_all_alarms, battery_0_multiturn_error_5);
  EXPECT_EQ(position_after(read_0, position_0_with_status).alarms, 1u);
  EXPECT_EQ(position_after(read_5, position_5_with_status).alarms, 2u);
}

TEST_F(CompletedReadingsByAlarms, AreForgottenAfterClearing) {
  after(read_alarms_0, battery_0);
  after(clear_0, battery_before_clearing);
  EXPECT_EQ(position_after(read_0, position_0_with_status).singleturn_validity(), Validity::unknown);
}

}  // namespace
}  // namespace absenc::capture
