// SPDX-License-Identifier: Apache-2.0
// What must hold for every position, format and clock.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "absenc/protocol/biss/bench_test.hpp"

namespace absenc::biss {
namespace {

PositionBits any_bits() {
  const auto position = *rc::gen::inRange(1u, 65u);
  return {position, *rc::gen::inRange(0u, 65u - position), *rc::gen::arbitrary<bool>()};
}

RC_GTEST_PROP(BissProperty, WhatIsSampledIsWhereTheShaftIs, (std::int64_t position, bool error, bool warning)) {
  const Format format{.word = word_with_status(any_bits()),
                      .check = *rc::gen::arbitrary<bool>() ? Check::crc6 : Check::crc16};
  const auto rate = *rc::gen::inRange(50'000u, 10'000'001u);
  const auto latency = Time(*rc::gen::inRange(0, 20'000));
  testing::Bench bench(line_settings, format, Behaviour{.latency = latency});
  bench.shaft.state.position = position;
  bench.encoder.raise_alarms((error ? word_error : 0) | (warning ? word_warning : 0));
  ReadPosition read(format, {.rate = rate, .latency = latency});
  RC_ASSERT(bench.run(read).error() == Error::none);
  RC_ASSERT(read.reply().word == bench.encoder.encoder().word(Time{}));
  RC_ASSERT(read.reply().word.error == error);
  RC_ASSERT(read.reply().word.warning == warning);
  RC_ASSERT(bench.encoder.violation_count() == 0u);
}

RC_GTEST_PROP(BissProperty, OneWrongBitOfTheDataIsAlwaysSeen, (std::uint64_t position, std::uint64_t turns)) {
  const PositionBits bits = any_bits();
  const Format format{.word = word_with_status(bits)};
  BitBuffer<128> good;
  const Word word{.position = position & low_mask(bits.position), .multiturn = turns & low_mask(bits.multiturn)};
  RC_ASSERT(encode(format, {.ack_bits = 1, .word = word}, good));
  const std::size_t first = idle_bits + 1 + 2;
  RC_ASSERT(decode(format, good.view())->word == word);
  for (std::size_t flip = first; flip < good.size(); ++flip) {
    std::array<std::uint8_t, 16> bad{};
    std::copy(good.bytes().begin(), good.bytes().end(), bad.begin());
    bad[flip / 8] ^= static_cast<std::uint8_t>(0x80u >> flip % 8);
    RC_ASSERT(decode(format, {bad, good.size()}).error() == Error::bad_checksum);
  }
}

}  // namespace
}  // namespace absenc::biss
