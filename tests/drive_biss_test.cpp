// SPDX-License-Identifier: Apache-2.0
// Tests the program of docs/drive.md for a drive with a BiSS encoder; a virtual encoder is at the other end of the
// line.
#include "firmware/hookup/drive_biss.cpp"

#include <gtest/gtest.h>

#include "absenc/protocol/biss/device.hpp"
#include "absenc/sim/motion.hpp"

namespace {

constexpr Time clock_period = Axis::format.period();

Time time_now{};
Time end_of_transfer = never;
bool is_clock_high = true;
std::size_t clocks = 0;
Device<std::uint8_t>* device = nullptr;

void run_until(Time end) {
  while (std::min(axis.carrier.due(), end_of_transfer) <= end) {
    time_now = std::min(axis.carrier.due(), end_of_transfer);
    if (time_now < end_of_transfer) {
      timer_tick();
      continue;
    }
    end_of_transfer = never;
    device->feed({.kind = ByteEvent::Kind::sent, .at = time_now, .bits = clocks});
    dma_complete();
  }
  time_now = end;
}

}  // namespace

Time now() { return time_now; }
void set_clock(bool high) { is_clock_high = high; }
void spi_receive(MutableBytes bytes) {
  clocks = 8 * bytes.size();
  device->feed({.kind = ByteEvent::Kind::selected, .at = time_now, .held_low = !is_clock_high, .width = clock_period});
  const ByteStep driven = device->next(time_now);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = i < driven.out.size() ? driven.out[i] : driven.behind_out();
  }
  end_of_transfer = time_now + static_cast<int>(clocks) * clock_period;
}

namespace {

TEST(DriveGuide, RegisterAccessRidesInCycles) {
  const sim::Motion motion = sim::Motion::constant_speed(0, 600);
  biss::VirtualEncoderOf<biss::Format> encoder(Axis::format, motion);
  encoder.memory()[17] = 0x5A;
  device = &encoder;
  encoder.power_on(time_now, Device<std::uint8_t>::PowerOn::skip);
  start();
  run_until(1ms);
  ASSERT_EQ(axis.last.kind, host::Cycle::Kind::fresh);

  Options options;
  constexpr std::array<OptionText, 3> settings{{{"ma_khz", "5000"}, {"adaptive_timeout", "true"}, {"latency_us", "1"}}};
  ASSERT_EQ(resolve_options(biss::unit, {}, settings, options).kind, OptionError::Kind::none);
  RegisterAccess access;
  constexpr std::array<std::int64_t, 3> address_bank_count{17, 0, 1};
  host::Service<std::uint8_t>* const service = access.start(options, address_bank_count);
  ASSERT_NE(service, nullptr);
  int cycles = 0;
  for (; !service->is_over() && cycles < 1000; ++cycles) {
    run_until(time_now + Axis::period);
    ASSERT_EQ(axis.last.kind, host::Cycle::Kind::fresh) << "the access cost cycle " << cycles;
    const std::int64_t truth = motion.at(axis.last.reading.latched).position >> 13 & 0x7FFFF;
    EXPECT_LE(std::abs(wrapped_difference(axis.last.reading.singleturn, static_cast<std::uint64_t>(truth), 19)), 60);
  }
  EXPECT_GT(cycles, 20);
  ASSERT_EQ(service->state(), host::Service<std::uint8_t>::State::done);
  ASSERT_EQ(service->conversation().error(), Error::none);
  struct Value final : FieldSink {
    void put(const FieldValue& value) override {
      if (value.info->role == Role::value) number = value.number;
    }
    std::int64_t number = -1;
  } value;
  service->conversation().report(value);
  EXPECT_EQ(value.number, 0x5A);
  EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
}

}  // namespace
