// SPDX-License-Identifier: Apache-2.0
// What is written, as text and as sigrok-cli reads it.
#include "absenc/capture/drawing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdio.h>
#include <stdlib.h>

#include <filesystem>
#include <sstream>
#include <stdexcept>

namespace absenc::capture {
namespace {

Drawing three_traces() {
  return {.title = "test",
          .traces = {{"a", {true, {1000, 3000, 3500}}}, {"b", {false, {3000}}}, {"c", {false, {}}}},
          .labels = {{1000, "begins"}},
          .end = 8000};
}

TEST(Drawing, Vcd) {
  std::ostringstream text;
  write_vcd(text, three_traces());
  EXPECT_EQ(text.str(),
            "$version absenc $end\n$timescale 1 ns $end\n$comment #1000 begins $end\n$scope module test $end\n"
            "$var wire 1 ! a $end\n$var wire 1 \" b $end\n$var wire 1 # c $end\n$upscope $end\n$enddefinitions $end\n"
            "#0\n1!\n0\"\n0#\n#1000\n0!\n#3000\n1!\n1\"\n#3500\n0!\n#8000\n");
}

TEST(Drawing, SaleaeCsv) {
  std::ostringstream text;
  write_saleae_csv(text, three_traces());
  EXPECT_EQ(text.str(),
            "Time [s],a,b,c\n0.000000000,1,0,0\n0.000001000,0,0,0\n0.000003000,1,1,0\n0.000003500,0,1,0\n"
            "0.000008000,0,1,0\n");
}

struct SigrokSession : ::testing::Test {
  SigrokSession() {
    std::string name = std::filesystem::temp_directory_path() / "absenc-drawing-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp");
    directory = name;
    path = directory / "drawing.sr";
  }
  ~SigrokSession() override { std::filesystem::remove_all(directory); }

  [[nodiscard]] std::string read(const std::string& arguments) const {
    const std::string command = "sigrok-cli -i " + path + ' ' + arguments + " 2>&1 </dev/null";
    FILE* pipe = ::popen(command.c_str(), "r");
    EXPECT_NE(pipe, nullptr);
    std::string text;
    for (int c = ::fgetc(pipe); c != EOF; c = ::fgetc(pipe)) text += static_cast<char>(c);
    EXPECT_EQ(::pclose(pipe), 0) << text;
    return text;
  }

  std::filesystem::path directory;
  std::string path;
};

TEST_F(SigrokSession, HasTheLevelsAtEverySample) {
  write_sigrok(path, three_traces(), 2'000'000);
  EXPECT_EQ(read("-O csv:header=false:label=off"),
            "1,0,0\n1,0,0\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n1,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n"
            "0,1,0\n");
  EXPECT_THAT(read("--show"), ::testing::AllOf(::testing::HasSubstr("2000000"),
                                               ::testing::HasSubstr("- a: logic\n- b: logic\n- c: logic")));
}

TEST_F(SigrokSession, OfMoreThanOnePartAndManyTraces) {
  Drawing drawing{.title = "many", .traces = {}, .labels = {}, .end = 10'000'000};
  for (Tick i = 0; i < 20; ++i) drawing.traces.push_back({"t" + std::to_string(i), {i % 2 == 0, {9'000'000 + i}}});
  write_sigrok(path, drawing, 1'000'000'000);
  const std::string text = read("-O vcd");
  for (Tick i = 0; i < 20; ++i) {
    EXPECT_THAT(text, ::testing::HasSubstr('#' + std::to_string(9'000'000 + i) + (i % 2 == 0 ? " 0" : " 1") +
                                           static_cast<char>('!' + i)));
  }
}

TEST_F(SigrokSession, SaysWhyItCannotBeWritten) {
  try {
    write_sigrok(directory / "missing" / "x.sr", three_traces(), 1'000'000);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("missing/x.sr cannot be written: "));
  }
}

}  // namespace
}  // namespace absenc::capture
