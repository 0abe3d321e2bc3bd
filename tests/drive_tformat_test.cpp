// SPDX-License-Identifier: Apache-2.0
// Tests the program of docs/drive.md for a drive with a T-format encoder; a virtual encoder is at the other end of the
// line.
#include "firmware/hookup/drive_tformat.cpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "absenc/protocol/tformat/device.hpp"
#include "absenc/sim/motion.hpp"

namespace {

constexpr Time character = tformat::line_settings.character();

Time time_now{};
bool is_stopped = false;
std::multimap<Time, std::function<void()>> events;

void send(Bytes bytes, void (*receive)(std::uint8_t), void (*sent)()) {
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool is_last = i + 1 == bytes.size();
    events.emplace(time_now + static_cast<int>(i + 1) * character, [=, byte = bytes[i]] {
      if (is_last) sent();
      receive(byte);
    });
  }
}

struct EncoderEnd {
  void begin(const ByteStep& step);
  void result(bool) {}
};
EncoderEnd encoder_end;
host::Carrier<std::uint8_t, EncoderEnd> encoder(encoder_end);
bool is_silent = false;

void encoder_received(std::uint8_t byte) { encoder.received({&byte, 1}, time_now); }
void encoder_sent() { encoder.sent(time_now); }
void nobody_received(std::uint8_t) {}
void EncoderEnd::begin(const ByteStep& step) {
  send(step.out, is_silent ? nobody_received : uart_byte_received, encoder_sent);
}

void run_until(Time end) {
  for (;;) {
    const Time first = events.empty() ? never : events.begin()->first;
    const Time next = std::min({first, axis.carrier.due(), encoder.due()});
    if (next > end) break;
    time_now = next;
    if (first == next) {
      const auto event = events.extract(events.begin());
      event.mapped()();
    } else if (encoder.due() <= next) {
      encoder.tick(time_now);
    } else {
      timer_tick();
    }
  }
  time_now = end;
}

}  // namespace

Time now() { return time_now; }
void uart_send(Bytes bytes) { send(bytes, encoder_received, uart_transmission_complete); }
void stop_the_drive() { is_stopped = true; }

namespace {

TEST(DriveGuide, ElectricalAngleFollowsShaftAndMissingRepliesStopTheDrive) {
  sim::Motion motion = sim::Motion::constant_speed(std::int64_t{5} << 32, 3000);
  // the shaft stands still at first, because an encoder that is switched on while its shaft turns has no valid position
  motion.begin_at(5ms);
  tformat::VirtualEncoder device(Axis::format, motion);
  device.power_on(time_now, Device<std::uint8_t>::PowerOn::skip);
  encoder.start(device, time_now);
  start();
  run_until(10ms);
  ASSERT_FALSE(is_stopped);
  for (int i = 0; i < 1000; ++i) {
    run_until(time_now + Axis::period);
    const Time instant = time_now + 50us;
    const auto found = static_cast<std::int32_t>(
        control_cycle(instant) -
        (static_cast<std::uint32_t>(motion.at(instant).position) * Axis::pole_pairs + Axis::offset));
    // The limit of the error of the electrical angle is four counts of the encoder: two of the position, and two
    // because the rounded speed extrapolates it over one and a half cycles.
    EXPECT_LT(std::abs(found), 4 * static_cast<int>(Axis::pole_pairs) * (1 << (32 - Axis::format.singleturn_bits)))
        << i;
  }
  EXPECT_FALSE(is_stopped);
  EXPECT_EQ(axis.cycles.cycle().stale, 0u);
  // A PWM event begins the next cycle earlier than planned.
  const Time early = time_now + 30us;
  axis.cycles.begin_next_at(early);
  axis.carrier.wake(time_now);
  run_until(early + 90us);
  EXPECT_EQ(axis.cycles.cycle().begun, early);
  EXPECT_EQ(axis.cycles.cycle().kind, host::Cycle::Kind::fresh);
  is_silent = true;
  run_until(time_now + 2 * Axis::period);
  EXPECT_FALSE(is_stopped);
  run_until(time_now + 3 * Axis::period);
  EXPECT_TRUE(is_stopped);
}

}  // namespace
