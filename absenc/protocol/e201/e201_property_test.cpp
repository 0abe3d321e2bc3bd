// SPDX-License-Identifier: Apache-2.0
// What must hold for every position, encoder and clock.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "absenc/protocol/e201/bench_test.hpp"

namespace absenc::e201 {
namespace {

PositionBits any_bits(unsigned most) {
  const auto position = *rc::gen::inRange(1u, most + 1);
  return {position, *rc::gen::inRange(0u, most + 1 - position), *rc::gen::arbitrary<bool>()};
}

RC_GTEST_PROP(E201Property, WhatIsReadIsWhereTheShaftIs, (std::int64_t position, bool warning)) {
  Format format;
  if (*rc::gen::arbitrary<bool>()) {
    format.biss.word = biss::word_with_status(any_bits(45));
  } else {
    format.carries = Carries::ssi;
    format.ssi.word = ssi::word_with(any_bits(60), *rc::gen::arbitrary<bool>(), ssi::ErrorBit::none, Parity::none);
    format.ssi.after_word = *rc::gen::elementOf(std::vector{ssi::AfterWord::repeat, ssi::AfterWord::zero});
  }
  const auto clock = *rc::gen::inRange(1u, 9u);
  const auto latency = clock_period(clock) * *rc::gen::inRange(0, 7);
  testing::Bench bench(format, {.clock = clock, .behaviour = {.latency = latency}});
  bench.shaft.state.position = position;
  if (warning) bench.adapter.raise_alarms(word_warning);
  ReadPosition read(format);
  bench.run(read);
  if (format.carries == Carries::ssi && read.error() == Error::line_stuck) return;  // all its bits are 1
  RC_ASSERT(read.error() == Error::none);
  Word truth = bench.adapter.word(Time{});
  if (format.carries == Carries::ssi) truth.warning = false;
  RC_ASSERT(read.position().word == truth);
}

RC_GTEST_PROP(E201Property, AnyClockAndWidthCanBeSet, ()) {
  testing::Bench bench;
  const auto clock = *rc::gen::inRange(1u, 9u);
  const auto width = *rc::gen::inRange(1u, 65u);
  Set set_clock(command::set_clock, clock);
  RC_ASSERT(bench.run(set_clock).error() == Error::none);
  Set set_width(command::set_width, width);
  RC_ASSERT(bench.run(set_width).error() == Error::none);
  RC_ASSERT(bench.raw("mb") == std::to_string(clock) + "\r" + std::to_string(width) + "\r");
}

RC_GTEST_PROP(E201Property, ZeroIsHereWhereverTheShaftStands, (std::int64_t position)) {
  testing::Bench bench;
  bench.shaft.state.position = position;
  Zero zero(bench.format);
  RC_ASSERT(bench.run(zero).error() == Error::none);
  RC_ASSERT(bench.raw("?") == "0\r");
}

}  // namespace
}  // namespace absenc::e201
