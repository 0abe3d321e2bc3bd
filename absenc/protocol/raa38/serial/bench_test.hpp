// SPDX-License-Identifier: Apache-2.0
// For tests: virtual RAA38S6 encoders and a host on one asynchronous line in virtual time.
#pragma once

#include "absenc/protocol/raa38/serial/device.hpp"
#include "absenc/protocol/raa38/serial/host.hpp"
#include "absenc/protocol/raa38/talk_test.hpp"

namespace absenc::raa38::serial {

[[nodiscard]] inline Options options_of(const Format& format) {
  Options options;
  options.values = {static_cast<std::int64_t>(format.mode),
                    format.bits,
                    format.unit,
                    static_cast<std::int64_t>(format.second_byte),
                    static_cast<std::int64_t>(format.zeroing),
                    format.zero_unit,
                    format.refresh_millihertz,
                    format.acquisition.count(),
                    format.transmission.count()};
  return options;
}

namespace testing {

using author::testing::Wire;
using raa38::testing::CommandResult;
using raa38::testing::ended;
using raa38::testing::says;

inline constexpr LineSettings line_of_tests{.rate = 115'200};
using Shaft14 = sim::testing::TestShaft<14>;

struct Talk final : raa38::testing::Talk<std::uint8_t> {
  Talk(const Format& format, std::string_view name)
      : raa38::testing::Talk<std::uint8_t>(serial_unit, options_of(format), name) {}
};

/// A virtual encoder whose frames a test can change; a frame that the test empties is not sent.
struct Tampered final : Device<std::uint8_t> {
  using Tamper = author::testing::Tamper;
  Tampered(const Format& format, const Shaft& shaft) : encoder(format, shaft) {}
  void set(Tamper how) { tamper = std::move(how); }

  void feed(const Event<std::uint8_t>& event) override { encoder.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    for (;;) {
      Step<std::uint8_t> step = encoder.next(now);
      if (step.kind != Step<std::uint8_t>::Kind::transfer || !tamper) return step;
      out.assign(step.out.begin(), step.out.end());
      tamper(frames++, out);
      step.out = out;
      if (!out.empty()) return step;
      encoder.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    }
  }
  void power_on(Time now, PowerOn kind) override { encoder.power_on(now, kind); }
  void power_off(Time now) override { encoder.power_off(now); }
  void raise_alarms(std::uint32_t) override {}
  void lower_alarms(std::uint32_t) override {}
  MutableBytes memory() override { return encoder.memory(); }
  [[nodiscard]] std::uint32_t memory_version() const override { return encoder.memory_version(); }
  [[nodiscard]] std::span<const Violation> violations() const override { return encoder.violations(); }
  [[nodiscard]] std::uint32_t violation_count() const override { return encoder.violation_count(); }
  [[nodiscard]] std::uint64_t answer_count() const override { return encoder.answer_count(); }

  VirtualEncoder encoder;
  Tamper tamper;
  unsigned frames = 0;
  Wire out;
};

struct Bench : raa38::testing::Bench<std::uint8_t, Tampered, Format, serial_unit> {
  explicit Bench(const Format& own)
      : raa38::testing::Bench<std::uint8_t, Tampered, Format, serial_unit>(own, LinkKind::half_duplex, line_of_tests) {
    put(383);
    add(own);
  }
  /// Adds an encoder whose zero differs by one count from that of the first encoder.
  void add_twin(const Format& of_it) { add(of_it).memory()[2] = 4; }
  /// Turns the shaft to the position `counts`, in counts of 14 bits.
  void put(std::int64_t counts) { shaft.put(0, counts << 7); }
};

}  // namespace testing
}  // namespace absenc::raa38::serial
