// SPDX-License-Identifier: Apache-2.0
// Tests of the history and of ClockWatch.
#include "absenc/serve/history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <regex>
#include <string>

#include "absenc/client/error.hpp"
#include "absenc/serve/chronicler.hpp"

namespace absenc::serve {
namespace {

using namespace std::chrono_literals;

TEST(ClockWatch, DetectsJumpsButIgnoresNtpAdjustments) {
  ClockWatch clock;
  Time now = 100s;
  std::int64_t calendar = 1'700'000'000'000;
  const auto pass = [&](Time time) {
    now += time;
    calendar += std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
    return clock.check(calendar, now);
  };
  EXPECT_EQ(clock.check(calendar, now), 0);
  EXPECT_EQ(pass(59min), 0);
  constexpr std::int64_t days_400 = 400LL * 86'400'000;
  calendar += days_400;
  EXPECT_EQ(pass(1s), days_400);
  EXPECT_EQ(pass(65s), 0);
  calendar -= days_400;
  EXPECT_EQ(pass(1s), -days_400);
  calendar += 500;
  EXPECT_EQ(pass(1h), 0);
}

std::string new_path() { return testing::TempDir() + "absenc-history-" + std::to_string(std::random_device()()); }

// Windows removes no open file, so the history must be closed before.
void remove_history(const std::string& path) {
  for (const char* ending : {"", "-wal", "-shm"}) std::filesystem::remove(path + ending);
}

HistoryWriter::Entry second_of(std::string encoder, std::int64_t at_s) {
  HistoryWriter::Entry entry{std::move(encoder), {}};
  entry.second.at_s = at_s;
  entry.second.readings = 1;
  return entry;
}

std::size_t seconds_in(HistoryWriter& writer, const std::string& encoder) {
  const std::string rows = writer.reader().csv(encoder, {0, 4'000'000'000}, 1'000'000).first;
  return static_cast<std::size_t>(std::count(rows.begin(), rows.end(), '\n'));
}

// The server is started with a clock that is 400 days ahead: no older rows are deleted at first.
TEST(History, DeletesOldRowsOnlyAfterADayOfNewerRows) {
  const std::string path = new_path();
  {
    HistoryWriter writer(path, {});
    const std::int64_t now = calendar_ms() / 1000;
    std::vector<HistoryWriter::Entry> seconds;
    for (std::int64_t i = 0; i < 100; ++i) seconds.push_back(second_of("one", now - 400 * 86'400 + i));
    for (std::int64_t i = 0; i < 60; ++i) seconds.push_back(second_of("two", now - i));
    writer.write(seconds, {});
  }
  {
    HistoryWriter writer(path, {});
    writer.trim();
    EXPECT_EQ(seconds_in(writer, "one"), 100U);
    std::vector<HistoryWriter::Entry> hours;
    for (std::int64_t i = 1; i <= 24; ++i) hours.push_back(second_of("two", calendar_ms() / 1000 - i * 3600));
    writer.write(hours, {});
    writer.trim();
    EXPECT_EQ(seconds_in(writer, "one"), 0U);
    EXPECT_EQ(seconds_in(writer, "two"), 84U);
  }
  remove_history(path);
}

// One row is years ahead, as a wrong clock would leave it.
TEST(History, DeletesOldestTenthOfRowsBeyondSizeLimit) {
  const std::string path = new_path();
  HistoryLimits limits;
  limits.bytes = 10'000;
  {
    HistoryWriter writer(path, {});
    std::vector<HistoryWriter::Entry> seconds;
    for (std::int64_t i = 0; i < 10'000; ++i) seconds.push_back(second_of("one", 1'000'000'000 + i));
    seconds.push_back(second_of("one", 3'000'000'000));
    writer.write(seconds, {});
  }
  {
    HistoryWriter writer(path, limits);
    EXPECT_EQ(seconds_in(writer, "one"), 9000U);
  }
  remove_history(path);
}

TEST(History, RefusesSecondWriter) {
  const std::string path = new_path();
  {
    const HistoryWriter first(path, {});
    try {
      const HistoryWriter second(path, {});
      FAIL() << "two writers opened the same file";
    } catch (const client::Failure& failure) {
      EXPECT_NE(std::string(failure.what()).find("another server"), std::string::npos) << failure.what();
    }
  }
  { const HistoryWriter third(path, {}); }
  remove_history(path);
}

TEST(History, CombinesReadingsOfRepeatedSecond) {
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

TEST(History, RowsOfARangeReachItsEnd) {
  const std::string path = new_path();
  {
    HistoryWriter writer(path, {});
    for (std::int64_t at_s = 1'000'001; at_s <= 1'000'004; ++at_s) {
      Second one;
      one.at_s = at_s;
      one.readings = 1;
      writer.write({{"one", one}}, {});
    }
    HistoryReader reader(path);
    for (std::int64_t most = 1; most <= 5; ++most) {
      const std::string found = reader.seconds("one", {1'000'001, 1'000'004}, most).line();
      const std::regex end_of_row(R"((\d+),\d+\])");  // a row ends with its numbers of readings and of errors
      std::int64_t rows = 0;
      int readings = 0;
      for (std::sregex_iterator at(found.begin(), found.end(), end_of_row); at != std::sregex_iterator(); ++at) {
        ++rows;
        readings += std::stoi((*at)[1]);
      }
      EXPECT_LE(rows, most) << found;
      EXPECT_EQ(readings, 4) << found;
    }
  }
  remove_history(path);
}

}  // namespace
}  // namespace absenc::serve
