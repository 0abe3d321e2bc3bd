// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "absenc/protocol/raa38/modbus/bench_test.hpp"

namespace absenc::raa38::rtu {
namespace {

using testing::Bench;

Format any_format() {
  return {.address = *rc::gen::inRange<std::uint8_t>(modbus::first_address, modbus::last_address + 1),
          .bits = *rc::gen::inRange(10u, 22u),
          .baud = *rc::gen::inRange<std::size_t>(0, bauds.size())};
}

Data any_data() { return *rc::gen::element(Data::four_bytes, Data::three_bytes, Data::three_as_four); }

RC_GTEST_PROP(Raa38ModbusProperty, APositionIsReadAsTheShaftStands, (std::uint32_t fraction)) {
  Bench bench(any_format(), any_data());
  bench.shaft.start.position = fraction;
  ReadPosition read(bench.format);
  RC_ASSERT(bench.run(read).error() == Error::none);
  RC_ASSERT(read.reading()->singleturn == fraction >> (32 - bench.format.bits));
  RC_ASSERT(bench.encoder.violation_count() == 0u);
}

RC_GTEST_PROP(Raa38ModbusProperty, ZeroIsHereWhereverTheShaftStands, (std::uint32_t fraction, bool backwards)) {
  Bench bench(any_format(), any_data());
  bench.shaft.start.position = fraction;
  if (backwards) {
    SetDirection set(bench.format, parameter::negative);
    RC_ASSERT(bench.run(set).error() == Error::none);
  }
  Zero zero(bench.format);
  RC_ASSERT(bench.run(zero).error() == Error::none);
  ReadPosition read(bench.format);
  RC_ASSERT(bench.run(read).error() == Error::none);
  RC_ASSERT(read.reading()->singleturn == 0u);
  RC_ASSERT(bench.encoder.violation_count() == 0u);
}

RC_GTEST_PROP(Raa38ModbusProperty, AnyAddressAndBaudRateIsSet, ()) {
  Bench bench(any_format());
  const Format wanted = any_format();
  SetAddress address(bench.format, wanted.address);
  RC_ASSERT(bench.run(address).error() == Error::none);
  Format now = bench.format;
  now.address = wanted.address;
  SetBaud baud(now, bauds[wanted.baud]);
  RC_ASSERT(bench.run(baud).error() == Error::none);
  RC_ASSERT(bench.encoder.address() == wanted.address);
  RC_ASSERT(bench.encoder.baud() == bauds[wanted.baud]);
  RC_ASSERT(bench.encoder.violation_count() == 0u);
}

RC_GTEST_PROP(Raa38ModbusProperty, ThreeWrongBitsAreAlwaysSeen, (std::uint32_t fraction)) {
  Bench bench(any_format(), any_data());
  bench.shaft.start.position = fraction;
  ReadPosition read(bench.format);
  bench.run(read);
  const Bytes reply = read.exchange().received;
  std::vector<std::uint8_t> bad(reply.begin(), reply.end());
  for (unsigned i = 0; i < 3; ++i) {
    const auto bit = *rc::gen::inRange<std::size_t>(0, reply.size() * 8);
    bad[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
  }
  RC_PRE(!std::ranges::equal(bad, reply));
  RC_ASSERT(!decode_reply(bench.format, read_request(bench.format), bad));
}

}  // namespace
}  // namespace absenc::raa38::rtu
