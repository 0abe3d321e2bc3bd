// SPDX-License-Identifier: Apache-2.0
// Checks how doctor judges positions and turns, and that it says which of their faults it could not see.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "absenc/client/doctor/observed_test.hpp"

namespace absenc::client {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

namespace {

/// Frames that waited in this computer are read all at once, so the speed of the shaft between them is unknown.
TEST(Doctor, APositionThatThisComputerTookLateIsNoJump) {
  Observations seen = positions([](std::size_t i) { return i * 20; });
  for (std::size_t i = 100; i < 150; ++i)
    seen.readings[i].reading->latched += 49ms;  // frames 100 to 149 arrive together, 149 ms after frame 0
  for (std::size_t i = 101; i < 150; ++i) {
    seen.readings[i].reading->latched = seen.readings[100].reading->latched + static_cast<std::int64_t>(i) * 1us;
  }
  for (std::size_t i = 150; i < 200; ++i) seen.readings[i].reading->latched += 50ms;
  for (std::size_t i = 101; i < 150; ++i) seen.readings[i].reading->singleturn = i * 400;
  EXPECT_THAT(ids(judged(seen)), Contains("position_jumps"));
  seen.computer_late = 50ms;
  EXPECT_THAT(ids(judged(seen)), Not(Contains("position_jumps")));
}

TEST(Doctor, TurnsThatDoNotFitThePositionAreNotGood) {
  const auto place = [](std::size_t i) { return i * hand_counts; };
  const auto right = [](std::size_t i) { return static_cast<std::int64_t>(i * hand_counts >> 17); };
  const auto random = [](std::size_t) {
    static std::mt19937 numbers(5);
    return static_cast<std::int64_t>(numbers() % 65'536);
  };
  const auto down = [&](std::size_t i) { return -right(i); };
  const auto late = [](std::size_t i) { return static_cast<std::int64_t>((i * hand_counts + 40'000) >> 17); };
  const auto still = [](std::size_t) { return 3; };
  using Turns = std::function<std::int64_t(std::size_t)>;
  const std::vector<std::tuple<std::string, Turns, std::vector<std::string>>> counters{
      {"right", right, {}},
      {"random", random, {"turns_jump"}},
      {"down", down, {"turns_jump"}},
      {"late", late, {"turns_jump"}},
      {"still", still, {"turns_stand"}}};
  for (const auto& [name, turns, wanted] : counters) {
    SCOPED_TRACE(name);
    Observations by_motor = positions(place);
    set_turns(by_motor.readings, turns);
    EXPECT_EQ(ids(judged(by_motor)), wanted);
    EXPECT_EQ(judged(by_motor).healthy(), name == "right");
    EXPECT_EQ(ids(judged(turned_by_hand(place, turns))), wanted);
  }
  Observations at_rest = positions([](std::size_t) { return 5; });
  set_turns(at_rest.readings, random);
  EXPECT_EQ(ids(judged(at_rest)), std::vector<std::string>{"turns_jump"});
  // One damaged reply may pass its checksum.
  set_turns(at_rest.readings, [](std::size_t i) { return i >= 100 ? 7 : 3; });
  EXPECT_EQ(ids(judged(at_rest)), std::vector<std::string>{"turns_jump"});
  at_rest.readings[50] = {.error = Error::bad_checksum, .heard = true};
  EXPECT_THAT(ids(judged(at_rest)), Not(Contains("turns_jump")));
}

TEST(Doctor, GoodSaysWhichTurnsAndJumpsWereNotLookedAt) {
  const auto place = [](std::size_t i) { return i * 600; };
  const auto turns = [](std::size_t) { return 3; };
  EXPECT_THAT(judged(positions(place)).not_looked_at, ElementsAre("a turning shaft (--turn)"));
  EXPECT_THAT(judged(turned_by_hand(place, turns)).not_looked_at, ElementsAre(StartsWith("the count of turns (")));
  const auto around = [](std::size_t i) { return i * hand_counts; };
  const auto right = [](std::size_t i) { return static_cast<std::int64_t>(i * hand_counts >> 17); };
  EXPECT_THAT(judged(turned_by_hand(around, right)).not_looked_at, IsEmpty());
  EXPECT_THAT(judged(turned_by_hand(around, right)).verdict(), Not(HasSubstr("not looked at")));
  Observations shortly = turned_by_hand(around, right);
  shortly.turned.resize(20);
  EXPECT_THAT(judged(shortly).not_looked_at, Contains(HasSubstr("only 20 valid positions while it was turned")));
  Observations invalid = positions(place);
  for (Attempted& one : invalid.readings) {
    one.reading->singleturn_known = false;
    one.reading->singleturn_valid_bits = 0;
  }
  EXPECT_THAT(judged(invalid).not_looked_at, Contains(StartsWith("the movement of the position (")));
}

/// Makes the readings `pause` apart.
void set_pause(std::vector<Attempted>& readings, Time pause) {
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i].reading->latched = static_cast<int>(i) * pause;
}

std::uint64_t random_place(std::size_t /*i*/) {
  static std::mt19937 numbers(6);
  return numbers();
}

TEST(Doctor, JumpsThatNoReadingCanShowWereNotLookedAt) {
  const std::string any = "jumps (the shaft could reach any position between two readings at 10000 rpm: set max_rpm)";
  for (const auto& place : {std::function<std::uint64_t(std::size_t)>(random_place),
                            std::function<std::uint64_t(std::size_t)>([](std::size_t i) { return i * 20; })}) {
    Observations slow = positions(place);
    EXPECT_THAT(judged(slow).not_looked_at, Not(Contains(HasSubstr("jumps"))));
    set_pause(slow.readings, 20ms);
    const Examination examination = judged(slow);
    EXPECT_THAT(examination.not_looked_at, Contains(any));
    EXPECT_THAT(examination.verdict(), AllOf(StartsWith("good: "), HasSubstr("not looked at: " + any)));
    EXPECT_NE(to_json(examination).line().find("\"not_looked_at\":[\"jumps ("), std::string::npos);
    // With turns, jumps over more turns than the shaft can turn are looked at.
    set_turns(slow.readings, [](std::size_t) { return 3; });
    EXPECT_THAT(judged(slow).not_looked_at, Contains(StartsWith("jumps of less than 5 turns (")));
    slow.turned = slow.readings;
    EXPECT_THAT(judged(slow).not_looked_at, Not(Contains(HasSubstr("while the shaft was turned (the shaft"))));
    slow.limit.rpm = 60;
    EXPECT_THAT(judged(slow).not_looked_at, Not(Contains(HasSubstr("jumps"))));
  }
  Observations random = positions(random_place);
  set_pause(random.readings, 20ms);
  random.limit.rpm = 60;
  EXPECT_THAT(ids(judged(random)), Contains("position_jumps"));
  // A position at rest did not jump, however slowly it was read.
  Observations at_rest = positions([](std::size_t i) { return i % 2; });
  set_pause(at_rest.readings, 20ms);
  EXPECT_THAT(judged(at_rest).not_looked_at, Not(Contains(HasSubstr("jumps"))));
  set_turns(at_rest.readings, [](std::size_t i) { return i % 3; });
  EXPECT_THAT(judged(at_rest).not_looked_at, Contains(HasSubstr("jumps")));
  // A few readings far apart hide hardly anything.
  Observations late = positions([](std::size_t i) { return i * 20; });
  for (std::size_t i = 100; i < 200; ++i) late.readings[i].reading->latched += 1s;
  EXPECT_THAT(judged(late).not_looked_at, Not(Contains(HasSubstr("jumps"))));
  late.computer_late = 20ms;
  EXPECT_THAT(judged(late).not_looked_at, Contains(any));
}

/// Each step may be one of a shaft, if the computer was late, but all together are not.
TEST(Doctor, RandomPositionsAreNotThoseOfAShaft) {
  for (const unsigned rpm : {5'900u, 600u, 0u}) {
    Observations seen = positions([rpm](std::size_t i) { return i * rpm * ((std::uint64_t{1} << 17) / 60) / 1000; });
    seen.limit.rpm = 6'000;
    seen.computer_late = 20ms;
    EXPECT_THAT(ids(judged(seen)), IsEmpty()) << rpm;
  }
  Observations random = positions(random_place);
  random.limit.rpm = 6'000;
  random.computer_late = 20ms;
  const Examination examination = judged(random);
  ASSERT_EQ(ids(examination), std::vector<std::string>{"position_jumps"});
  EXPECT_THAT(examination.findings[0].evidence,
              AllOf(HasSubstr("200 readings"), HasSubstr("more than 6000 rpm allow")));
}

/// The position of a request is latched between the beginning of the request and the end of its reply.
TEST(Doctor, ALateComputerHidesNoJumpBetweenRequests) {
  Observations seen = positions([](std::size_t i) { return i == 70 ? 60'000u : i * 20; });
  seen.computer_late = 20ms;
  EXPECT_THAT(ids(judged(seen)), IsEmpty());
  for (Attempted& one : seen.readings) {
    one.began = one.reading->latched - 10us;
    one.reading->received = one.reading->latched + 100us;
  }
  EXPECT_THAT(ids(judged(seen)), IsEmpty()) << "nothing was requested";
  for (Attempted& one : seen.readings) one.exchange.request.bytes = {0x1A};
  EXPECT_THAT(ids(judged(seen)), Contains("position_jumps"));
  // The computer was late while these replies arrived.
  for (std::size_t i = 69; i < 72; ++i) seen.readings[i].reading->received += 20ms;
  EXPECT_THAT(ids(judged(seen)), IsEmpty());
}

}  // namespace
}  // namespace absenc::client
