// SPDX-License-Identifier: Apache-2.0
// What must hold for every position and every word.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/host.hpp"

namespace absenc::ssi {
namespace {

WordFormat any_word() {
  const auto position = *rc::gen::inRange(1u, 65u);
  const PositionBits bits{position, *rc::gen::inRange(0u, 65u - position), *rc::gen::arbitrary<bool>()};
  return word_with(bits, *rc::gen::arbitrary<bool>(),
                   *rc::gen::elementOf(std::vector{ErrorBit::none, ErrorBit::active_high, ErrorBit::active_low}),
                   *rc::gen::elementOf(std::vector{Parity::none, Parity::even, Parity::odd}));
}

RC_GTEST_PROP(SsiProperty, WhatIsReadIsWhereTheShaftIs, (std::int64_t position, bool error)) {
  Format format{.word = any_word(),
                .after_word = *rc::gen::elementOf(std::vector{AfterWord::repeat, AfterWord::zero, AfterWord::one})};
  format.extra_clocks = *rc::gen::inRange(0u, format.word.bits() + 1);
  biss::testing::ClockedBench<VirtualEncoder> bench(line_settings, format);
  bench.shaft.state.position = position;
  if (error) bench.encoder.raise_alarms(word_error);
  ReadPosition read(format);
  RC_ASSERT(bench.run(read).error() == Error::none);
  Word truth = bench.encoder.word(Time{});
  if (format.word.find(Meaning::error) == nullptr) truth.error = false;
  RC_ASSERT(read.word() == truth);
  RC_ASSERT(bench.encoder.violation_count() == 0u);
}

RC_GTEST_PROP(SsiProperty, OneWrongBitIsSeenWhereTheWordIsReadTwice, (std::int64_t position)) {
  Format format{.word = any_word()};
  format.extra_clocks = format.word.bits();
  BitBuffer<frame_capacity> good;
  RC_ASSERT(encode(format, word_of(format.word, {.position = position}, 0), clocks(format), good));
  RC_ASSERT(decode(format, good.view()).has_value());
  for (std::size_t flip = 0; flip < good.size(); ++flip) {
    std::array<std::uint8_t, frame_capacity / 8> bad{};
    std::copy(good.bytes().begin(), good.bytes().end(), bad.begin());
    bad[flip / 8] ^= static_cast<std::uint8_t>(0x80u >> flip % 8);
    RC_ASSERT(!decode(format, {bad, good.size()}).has_value());
  }
}

}  // namespace
}  // namespace absenc::ssi
