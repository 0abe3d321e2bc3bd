// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

Format any_format() {
  return {.resolution = *rc::gen::inRange(1u, maximum_resolution + 1), .multiturn_bits = *rc::gen::inRange(0, 17)};
}

Position any_position(const Format& format) {
  return {.singleturn = static_cast<std::uint32_t>(*rc::gen::arbitrary<std::uint32_t>() & low_mask(format.resolution)),
          .multiturn = static_cast<std::uint16_t>(*rc::gen::arbitrary<std::uint16_t>() &
                                                  low_mask(static_cast<unsigned>(format.multiturn_bits))),
          .error = *rc::gen::arbitrary<bool>(),
          .warning = *rc::gen::arbitrary<bool>(),
          .channel2 = *rc::gen::arbitrary<std::uint8_t>()};
}

RC_GTEST_PROP(EncolinkProperty, APositionSurvivesItsFrame, ()) {
  const Format format = any_format();
  const Position position = any_position(format);
  const Result<Position> decoded = decode_position(format, encode_position(format, position));
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(same_place(*decoded, position));
  RC_ASSERT(decoded->error == position.error && decoded->warning == position.warning);
  RC_ASSERT(decoded->channel2 == position.channel2);
}

RC_GTEST_PROP(EncolinkProperty, ACycleSurvivesToo, (std::uint16_t detailed, std::uint8_t byte)) {
  const Format format = any_format();
  const Position position = any_position(format);
  const Result<Cycle> decoded = decode_cycle(format, encode_cycle(format, {position, detailed, byte}));
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(same_place(decoded->position, position));
  RC_ASSERT(decoded->status == detailed && decoded->channel3 == byte);
}

RC_GTEST_PROP(EncolinkProperty, OneWrongBitOfACycleIsAlwaysSeen, (std::uint16_t detailed, std::uint8_t byte)) {
  const Format format = any_format();
  const ReplyBytes good = encode_cycle(format, {any_position(format), detailed, byte});
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    ReplyBytes bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    RC_ASSERT(!decode_cycle(format, bad).has_value());
  }
}

RC_GTEST_PROP(EncolinkProperty, AnAccessSurvivesItsBytes, (std::uint32_t address, std::uint64_t value)) {
  const auto size = *rc::gen::inRange<std::uint16_t>(1, 9);
  const RegisterRequest request = *rc::gen::arbitrary<bool>()
                                      ? write_request(address, size, value & low_mask(8u * size))
                                      : read_request(address, size);
  const Result<RegisterRequest> decoded = decode_access(encode_access(request));
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(decoded->operation == request.operation && decoded->address == address && decoded->length == size);
  RC_ASSERT(load_big_endian(decoded->data) == load_big_endian(request.data));
}

RC_GTEST_PROP(EncolinkProperty, APositionIsReadAsTheShaftStands, (std::int32_t turns, std::uint32_t fraction)) {
  const Format format = any_format();
  const Wire wire = *rc::gen::element(Wire::uart, Wire::spi);
  testing::Bench bench(format, wire);
  bench.shaft.start.position = (std::int64_t{turns} << 32) + fraction;
  const testing::Told read = bench.run("position");
  RC_ASSERT(read.error == Error::none);
  RC_ASSERT(read.reading->singleturn == fraction >> (32 - format.resolution));
  RC_ASSERT(read.reading->multiturn ==
            (static_cast<std::uint32_t>(turns) & low_mask(static_cast<unsigned>(format.multiturn_bits))));
}

RC_GTEST_PROP(EncolinkProperty, ZeroIsHereWhereverTheShaftStands,
              (std::int32_t turns, std::uint32_t fraction, std::uint32_t offset)) {
  Format format = testing::multi;
  format.offset_sign = *rc::gen::element(OffsetSign::add, OffsetSign::subtract);
  testing::Bench bench(format);
  bench.shaft.start.position = (std::int64_t{turns} << 32) + fraction;
  RC_ASSERT(bench.run("memory-write", {0, offset & 0xFFFFF}).error == Error::none);
  RC_ASSERT(bench.run("zero").error == Error::none);
  RC_ASSERT(bench.run("position").reading->singleturn == 0u);
}

}  // namespace
}  // namespace absenc::encolink
