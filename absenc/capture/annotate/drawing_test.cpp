// SPDX-License-Identifier: Apache-2.0
// Tests the files that drawings are written to, as text and as sigrok-cli reads them.
#include "absenc/capture/annotate/drawing.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>
#include <stdio.h>
#include <stdlib.h>

#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace absenc::capture {
namespace {

Drawing three_wires() {
  Drawing drawing("test");
  drawing.change(1000, 0);
  drawing.change(3000, 0);
  drawing.change(3000, 1);
  drawing.change(3500, 0);
  drawing.label(1000, "begins");
  drawing.add_wire("a", true);
  drawing.add_wire("b", false);
  drawing.add_wire("c", false);
  drawing.set_end(8000);
  return drawing;
}

TEST(Drawing, Vcd) {
  std::ostringstream text;
  Drawing drawing = three_wires();
  write_vcd(text, drawing);
  EXPECT_EQ(text.str(),
            "$version absenc $end\n$timescale 1 ns $end\n$comment #1000 begins $end\n$scope module test $end\n"
            "$var wire 1 ! a $end\n$var wire 1 \" b $end\n$var wire 1 # c $end\n$upscope $end\n$enddefinitions $end\n"
            "#0\n1!\n0\"\n0#\n#1000\n0!\n#3000\n1!\n1\"\n#3500\n0!\n#8000\n");
}

TEST(Drawing, SaleaeCsv) {
  std::ostringstream text;
  Drawing drawing = three_wires();
  write_saleae_csv(text, drawing);
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
  Drawing drawing = three_wires();
  write_sigrok(path, drawing, 2'000'000);
  EXPECT_EQ(read("-O csv:header=false:label=off"),
            "1,0,0\n1,0,0\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n1,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n0,1,0\n"
            "0,1,0\n");
  EXPECT_THAT(read("--show"), ::testing::AllOf(::testing::HasSubstr("2000000"),
                                               ::testing::HasSubstr("- a: logic\n- b: logic\n- c: logic")));
}

TEST_F(SigrokSession, OfMoreThanOnePartAndManyTraces) {
  Drawing drawing("many");
  drawing.set_end(10'000'000);
  for (Tick i = 0; i < 20; ++i) {
    drawing.add_wire("t" + std::to_string(i), i % 2 == 0);
    drawing.change(9'000'000 + i, i);
  }
  write_sigrok(path, drawing, 1'000'000'000);
  const std::string text = read("-O vcd");
  for (Tick i = 0; i < 20; ++i) {
    EXPECT_THAT(text, ::testing::HasSubstr('#' + std::to_string(9'000'000 + i) + (i % 2 == 0 ? " 0" : " 1") +
                                           static_cast<char>('!' + i)));
  }
}

TEST_F(SigrokSession, ErrorStatesReason) {
  Drawing drawing = three_wires();
  try {
    write_sigrok(directory / "missing" / "x.sr", drawing, 1'000'000);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("missing/x.sr cannot be written: "));
  }
}

TEST_F(SigrokSession, CanBeCancelled) {
  Drawing drawing = three_wires();
  drawing.set_end(100'000'000);
  int left = 3;
  drawing.watch([&] {
    if (--left == 0) throw std::logic_error("enough");
  });
  EXPECT_THROW(write_sigrok(path, drawing, 1'000'000'000), std::logic_error);
  EXPECT_TRUE(std::filesystem::is_empty(directory));
}

TEST(Drawing, IsWrittenTwiceTheSame) {
  Drawing drawing("long");
  drawing.add_wire("a", false);
  Tick at = 0;
  for (Tick i = 0; i < 100'000; ++i) drawing.change(at += i % 1000 * i, 0);
  drawing.label(Tick{1} << 60, std::string(1000, 'x'));
  drawing.set_end(std::numeric_limits<Tick>::max() - 1);
  std::ostringstream first, second;
  write_vcd(first, drawing);
  write_vcd(second, drawing);
  EXPECT_EQ(first.str(), second.str());
  EXPECT_THAT(first.str(), ::testing::HasSubstr("$comment #1152921504606846976 xxx"));
}

// Checks that a full disk (ENOSPC) is an error, not a shorter waveform.
TEST(Drawing, ReportsFullDisk) {
  Drawing drawing("full", ScratchFile(std::fopen("/dev/full", "w+")));
  EXPECT_THROW(for (Tick at = 0; at < 100'000; ++at) drawing.change(at, 0);
               drawing.rewind_changes(), std::runtime_error);
}

}  // namespace
}  // namespace absenc::capture
