// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "absenc/protocol/esl/bench_test.hpp"
#include "absenc/protocol/esl/settings.hpp"

namespace absenc::esl {
namespace {

Profile any_profile() {
  Profile profile;
  for (std::size_t i = 0; i < open_options; ++i) {
    const auto count = static_cast<std::int64_t>(options[i].choices.size());
    set_option(profile, i, *rc::gen::inRange<std::int64_t>(0, count));
  }
  profile.address = *rc::gen::inRange<std::uint8_t>(0, 8);
  return profile;
}

RC_GTEST_PROP(EslProperty, APositionIsReadAsTheShaftStandsInEveryProfile,
              (std::int32_t position, std::uint32_t fraction)) {
  const Profile profile = any_profile();
  testing::Bench bench(profile);
  bench.shaft.start.position = (std::int64_t{position} << 32) + fraction;
  const Reply reply = bench.read();
  RC_ASSERT(reply.singleturn == fraction >> 8);
  RC_ASSERT(reply.multiturn == (static_cast<std::uint32_t>(position) & 0xFFFF));
  RC_ASSERT(reply.redundant == fraction >> 23);
  ReadSafePosition safe(profile);
  bench.run(safe);
  RC_ASSERT(safe.position() != nullptr);
  RC_ASSERT(safe.position()->singleturn() == fraction >> 8);
}

RC_GTEST_PROP(EslProperty, AnyByteAtAnyUserAddressIsKept, ()) {
  const auto page = *rc::gen::inRange<std::uint8_t>(0, 4);
  const auto address = *rc::gen::inRange<std::uint8_t>(0, last_address + 1);
  const auto value = *rc::gen::arbitrary<std::uint8_t>();
  const Profile profile = any_profile();
  testing::Bench bench(profile);
  WriteMemory write(profile, page, address, value);
  RC_ASSERT(bench.run(write).error() == Error::none);
  ReadMemory read(profile, page, address);
  RC_ASSERT(bench.run(read).error() == Error::none);
  RC_ASSERT(read.data()[0] == value);
  RC_ASSERT(bench.encoder.writes() == (value == 0 ? 0u : 1u));
  RC_ASSERT(bench.encoder.violation_count() == 0u);
}

RC_GTEST_PROP(EslProperty, ZeroIsHereWhereverTheShaftStands, (std::int32_t position, std::uint32_t fraction)) {
  testing::Bench bench;
  bench.shaft.start.position = (std::int64_t{position} << 32) + fraction;
  const unsigned turns = bench.read().multiturn;
  Reset zero({}, DataId::zero);
  RC_ASSERT(bench.run(zero).error() == Error::none);
  RC_ASSERT(bench.read().singleturn == 0u);
  RC_ASSERT(bench.read().multiturn == turns);
}

RC_GTEST_PROP(EslProperty, UpToFourWrongBitsAreAlwaysSeen,
              (std::uint32_t singleturn, std::uint16_t turns, std::uint8_t almc, std::uint8_t counter)) {
  Reply reply{
      .one = {.status = status::ready, .alarms = almc, .sequence = counter},
      .two = {.status = status::ready | status::channel_2, .sequence = static_cast<std::uint8_t>(counter & 0x7F)},
      .singleturn = singleturn & 0xFFFFFF,
      .multiturn = turns};
  reply.redundant = static_cast<std::uint16_t>(reply.singleturn >> 15);
  const Profile profile = any_profile();
  const ReplyBytes good = encode_reply(profile, reply);
  RC_ASSERT(decode_reply(profile, {}, good).has_value());
  const auto bits = *rc::gen::unique<std::vector<unsigned>>(4, rc::gen::inRange(0u, 144u));
  const auto count = *rc::gen::inRange<std::size_t>(1, 5);
  ReplyBytes bad = good;
  for (std::size_t i = 0; i < count; ++i) bad[bits[i] / 8] ^= static_cast<std::uint8_t>(1u << bits[i] % 8);
  RC_ASSERT(!decode_reply(profile, {}, bad).has_value());
}

}  // namespace
}  // namespace absenc::esl
