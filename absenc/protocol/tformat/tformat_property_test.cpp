// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "absenc/protocol/tformat/bench_test.hpp"

namespace absenc::tformat {
namespace {

RC_GTEST_PROP(TformatProperty, APositionIsReadAsTheShaftStands, (std::int32_t position, std::uint32_t fraction)) {
  testing::Bench bench;
  bench.shaft.start.position = (std::int64_t{position} << 32) + fraction;
  const Reply reply = bench.everything();
  RC_ASSERT(reply.singleturn == fraction >> 15);
  RC_ASSERT(reply.multiturn == (static_cast<std::uint32_t>(position) & 0xFFFF));
}

RC_GTEST_PROP(TformatProperty, AnyByteAtAnyOpenAddressIsKept, ()) {
  const auto page = *rc::gen::inRange<std::uint8_t>(0, user_pages);
  const auto address = *rc::gen::inRange<std::uint8_t>(0, page_addresses);
  const auto value = *rc::gen::arbitrary<std::uint8_t>();
  testing::Bench bench;
  WriteMemory write({}, page, address, value);
  RC_ASSERT(bench.run(write).error() == Error::none);
  ReadMemory read({}, page, address);
  RC_ASSERT(bench.run(read).error() == Error::none);
  RC_ASSERT(read.data()[0] == value);
  RC_ASSERT(bench.encoder.writes() == (value == 0 ? 0u : 1u));
  RC_ASSERT(bench.encoder.violation_count() == 0u);
}

RC_GTEST_PROP(TformatProperty, ZeroIsHereWhereverTheShaftStands, (std::int32_t position, std::uint32_t fraction)) {
  testing::Bench bench;
  bench.shaft.start.position = (std::int64_t{position} << 32) + fraction;
  const std::uint32_t turns = bench.everything().multiturn;
  Reset zero({}, DataId::zero);
  RC_ASSERT(bench.run(zero).error() == Error::none);
  RC_ASSERT(bench.everything().singleturn == 0u);
  RC_ASSERT(bench.everything().multiturn == turns);
}

RC_GTEST_PROP(TformatProperty, OneWrongBitIsAlwaysSeen,
              (std::uint32_t singleturn, std::uint16_t turns, std::uint8_t almc)) {
  const Reply reply{.status = status_for(almc),
                    .singleturn = singleturn & 0x1FFFF,
                    .multiturn = turns,
                    .encoder_id = 0x11,
                    .alarms = almc};
  const ReplyBytes good = encode_reply(reply);
  RC_ASSERT(decode_reply({}, {DataId::everything}, good).has_value());
  for (unsigned bit = 0; bit < 88; ++bit) {
    ReplyBytes bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    RC_ASSERT(!decode_reply({}, {DataId::everything}, bad).has_value());
  }
}

}  // namespace
}  // namespace absenc::tformat
