// SPDX-License-Identifier: Apache-2.0
// The history keeps its seconds when the calendar's clock is wrong.
#include "absenc/serve/history.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>

#include "absenc/client/error.hpp"
#include "absenc/serve/chronicler.hpp"

namespace absenc::serve {
namespace {

using namespace std::chrono_literals;

TEST(ClockWatch, DoubtsTheClockForAnHourAfterTheStartAndAfterEachJump) {
  ClockWatch clock;
  Time now = 100s;
  std::int64_t calendar = 1'700'000'000'000;
  const auto pass = [&](Time time) {
    now += time;
    calendar += std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
    return clock.look(calendar, now);
  };
  EXPECT_FALSE(clock.is_trusted(now));
  EXPECT_EQ(clock.look(calendar, now), 0);
  EXPECT_FALSE(clock.is_trusted(now));
  EXPECT_EQ(pass(59min), 0);
  EXPECT_FALSE(clock.is_trusted(now));
  EXPECT_EQ(pass(2min), 0);
  EXPECT_TRUE(clock.is_trusted(now));
  constexpr std::int64_t days_400 = 400LL * 86'400'000;
  calendar += days_400;
  EXPECT_EQ(pass(1s), days_400);
  EXPECT_FALSE(clock.is_trusted(now));
  EXPECT_EQ(pass(65s), 0);
  calendar -= days_400;
  EXPECT_EQ(pass(1s), -days_400);
  EXPECT_FALSE(clock.is_trusted(now));
  calendar += 500;  // as NTP sets it
  EXPECT_EQ(pass(1h), 0);
  EXPECT_TRUE(clock.is_trusted(now));
}

std::string new_path() { return testing::TempDir() + "absenc-history-" + std::to_string(std::random_device()()); }

void remove_history(const std::string& path) {
  for (const char* ending : {"", "-wal", "-shm"}) std::filesystem::remove(path + ending);
}

// The clock stands years behind the last second that was written.
TEST(History, IsNotDeletedAtTheStartByAClockThatMayBeWrong) {
  const std::string path = new_path();
  Second old;
  old.at_s = 1'000'000'000;
  old.readings = 1;
  HistoryWriter(path, {}).write({{"one", old}}, {});
  { const HistoryWriter again(path, {}); }
  HistoryReader reader(path);
  EXPECT_NE(reader.seconds("one", {0, 2'000'000'000}, 10).line(), "[]");
  remove_history(path);
}

TEST(History, IsWrittenByOneServer) {
  const std::string path = new_path();
  {
    const HistoryWriter first(path, {});
    try {
      const HistoryWriter second(path, {});
      FAIL() << "both write it";
    } catch (const client::Failure& failure) {
      EXPECT_NE(std::string(failure.what()).find("another server"), std::string::npos) << failure.what();
    }
  }
  { const HistoryWriter third(path, {}); }
  remove_history(path);
}

TEST(History, SecondThatComesTwiceHasTheReadingsOfBoth) {
  const std::string path = new_path();
  {
    HistoryWriter writer(path, {});
    const auto second = [](std::uint64_t readings, double least, double greatest) {
      Second one;
      one.at_s = 1'700'000'000;
      one.readings = readings;
      one.errors = 1;
      one.place = {.count = readings,
                   .least = least,
                   .greatest = greatest,
                   .sum = (least + greatest) / 2 * static_cast<double>(readings)};
      return one;
    };
    writer.write({{"one", second(100, 1, 3)}}, {});
    writer.write({{"one", second(300, 5, 7)}}, {});
    Second silent;
    silent.at_s = 1'700'000'000;
    writer.write({{"one", silent}}, {});
    EXPECT_EQ(writer.trouble(), "");
    HistoryReader reader(path);
    const std::string found = reader.seconds("one", {1'700'000'000, 1'700'000'000}, 10).line();
    for (const char* part : {"400", "1.0", "5.0", "7.0"}) {
      EXPECT_NE(found.find(part), std::string::npos) << part << " in " << found;
    }
  }
  remove_history(path);
}

}  // namespace
}  // namespace absenc::serve
