// SPDX-License-Identifier: Apache-2.0
// Tests `decode`, `identify` and `identify_capture`.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "absenc/client/decode.hpp"
#include "absenc/client/emulate.hpp"
#include "absenc/client/encoder.hpp"
#include "absenc/client/identify.hpp"
#include "absenc/client/test_support.hpp"

namespace absenc::client {

using testing::HasSubstr;

namespace {

/// A temporary file with a name that no other test uses.
class TestFile {
 public:
  explicit TestFile(const std::string& text) { std::ofstream(path_) << text; }
  ~TestFile() { std::filesystem::remove(path_); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_ = own_path("capture") + ".txt";
};

constexpr std::string_view good = "1A\n1A 00 45 23 01 11 34 12 00 00 4A\n";
constexpr std::string_view bad = "1A\n1A 00 45 23 01 11 34 12 00 00 4B\n";

TEST(ClientDecode, RowsHaveTypedColumns) {
  const TestFile file(std::string(good) + std::string(bad) + std::string(good));
  Decoded rows = decode(file.path(), "tformat");
  std::vector<std::string> errors;
  for (const Row& row : rows) {
    ASSERT_EQ(row.columns.size(), row.values.size());
    EXPECT_EQ(row.get<std::string>("kind"), "exchange");
    EXPECT_EQ(row.get<ByteVector>("request"), ByteVector{0x1A});
    errors.push_back(to_text(row["error"]));
    const bool is_good = errors.back().empty();
    EXPECT_EQ(std::holds_alternative<std::monostate>(row["singleturn"]), !is_good);
    EXPECT_EQ(std::holds_alternative<std::monostate>(row["angle_deg"]), !is_good);
    EXPECT_EQ(std::holds_alternative<std::monostate>(row["message"]), is_good);
    if (!is_good) continue;
    EXPECT_EQ(to_text(row["singleturn"]), "74565");
    EXPECT_NEAR(row.get<double>("angle_deg"), 74565 * 360.0 / (1 << 17), 1e-9);
  }
  EXPECT_EQ(errors, (std::vector<std::string>{"", "bad_checksum", ""}));
}

TEST(ClientIdentify, SaysHowToOpenWhatItFound) {
  const Emulation emulation = emulate("tformat?motion=rpm=60");
  Identified all;
  // The host waits several latencies for each unanswered request, so the shortest latency is tried first.
  for (const char* const latency : {"20", "200", "1000"}) {
    all = identify(emulation.path() + "?latency=" + latency, {.limit = std::chrono::minutes(5)});
    if (!all.found.empty() && all.found[0].sure) break;
  }
  ASSERT_FALSE(all.found.empty());
  EXPECT_TRUE(all.found[0].sure);
  EXPECT_EQ(all.found[0].unit, &emulation.unit());
  EXPECT_LT(all.found[0].log10_chance, -3);
  Encoder encoder = open(all.found[0].address);
  bool ready = false;
  for (int i = 0; i < 100 && !ready; ++i) ready = encoder.read().ready;
  EXPECT_TRUE(ready);
  EXPECT_THAT(thrown_by<UsageError>([] { static_cast<void>(identify("sim:tformat")); }), HasSubstr("which protocol"));
}

TEST(ClientIdentify, TellsWhoseFramesAreInACapture) {
  const TestFile file("1A\n1A 00 45 23 01 11 34 12 00 00 4A\n1A\n1A 00 46 23 01 11 34 12 00 00 49\n");
  const Identified all = identify_capture(file.path());
  ASSERT_FALSE(all.found.empty());
  EXPECT_EQ(all.found[0].unit->id, "tformat");
  EXPECT_EQ(all.found[0].explained, 2u);
  EXPECT_THROW(static_cast<void>(identify_capture(file.path(), {.model = "23-bit"})), UsageError);
}

TEST(ClientDecode, WhoeverHasEnoughEndsIt) {
  std::string text;
  for (int i = 0; i < 20'000; ++i) text += good;
  const TestFile file(text);
  {
    Decoded rows = decode(file.path(), "tformat");
    EXPECT_EQ(to_text((*rows.begin())["singleturn"]), "74565");
  }
  std::size_t count = 0;
  for (const Row& row : decode(file.path(), "tformat")) count += to_text(row["error"]).empty() ? 1 : 0;
  EXPECT_EQ(count, 20'000u);
}

TEST(ClientDecode, WhatCannotBeDecodedSaysSo) {
  EXPECT_THAT(thrown_by<Failure>([] { static_cast<void>(decode("/nowhere/absenc.sr", "tformat")); }),
              HasSubstr("/nowhere/absenc.sr"));
  const TestFile file("nothing that could be bytes\n");
  EXPECT_NE(thrown_by<Failure>([&] {
              for (const Row& row : decode(file.path(), "tformat")) static_cast<void>(row);
            }),
            "nothing was thrown");
  EXPECT_THAT(thrown_by<UsageError>([&] { static_cast<void>(decode(file.path(), "tfromat")); }), HasSubstr("tformat"));
}

}  // namespace
}  // namespace absenc::client
