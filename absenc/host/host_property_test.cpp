// SPDX-License-Identifier: Apache-2.0
// Tests reach, unwrapping and velocity with random speeds and motions.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "absenc/host/unwrap.hpp"
#include "absenc/host/velocity.hpp"

namespace absenc::host {
namespace {

/// Returns the reading of an encoder with the given numbers of bits at `position`.
Reading shown(std::int64_t position, unsigned singleturn_bits, unsigned multiturn_bits, Time at) {
  const auto counts = static_cast<std::uint64_t>(position);
  Reading reading{.singleturn = counts & low_mask(singleturn_bits),
                  .multiturn = counts >> singleturn_bits & low_mask(multiturn_bits),
                  .singleturn_bits = singleturn_bits,
                  .multiturn_bits = multiturn_bits,
                  .singleturn_valid_bits = singleturn_bits,
                  .multiturn_valid = multiturn_bits != 0};
  reading.latched = at;
  return reading;
}

struct Counter {
  unsigned singleturn_bits;
  unsigned multiturn_bits;
  [[nodiscard]] std::int64_t half() const { return std::int64_t{1} << (singleturn_bits + multiturn_bits - 1); }
};

Counter any_resolution() {
  const auto singleturn_bits = *rc::gen::inRange<unsigned>(1, 33);
  return {singleturn_bits, *rc::gen::inRange<unsigned>(0, 17)};
}

RC_GTEST_PROP(UnwrapProperty, FollowsEveryMotionBelowHalfTheRangeAStep, (std::int32_t start)) {
  const auto [singleturn_bits, multiturn_bits] = any_resolution();
  const std::int64_t half = Counter{singleturn_bits, multiturn_bits}.half();
  Unwrapper unwrapper;
  std::int64_t position = start;
  unwrapper.add(shown(position, singleturn_bits, multiturn_bits, Time{}));
  const std::int64_t offset = unwrapper.position() - position;
  for (int i = 1; i <= 200; ++i) {
    // The distance between two positions goes from minus half the counted range up to one count below half this range.
    position += *rc::gen::weightedOneOf<std::int64_t>(
        {{8, rc::gen::inRange<std::int64_t>(-half, half)}, {1, rc::gen::just(-half)}, {1, rc::gen::just(half - 1)}});
    RC_ASSERT(unwrapper.add(shown(position, singleturn_bits, multiturn_bits, Time(i))) == Unwrapper::Joined::continued);
    RC_ASSERT(unwrapper.position() == position + offset);
  }
}

RC_GTEST_PROP(UnwrapProperty, CannotFollowFromHalfTheRangeOn, (std::int32_t start)) {
  const auto [singleturn_bits, multiturn_bits] = any_resolution();
  const std::int64_t half = Counter{singleturn_bits, multiturn_bits}.half();
  Unwrapper unwrapper;
  unwrapper.add(shown(start, singleturn_bits, multiturn_bits, Time{}));
  const std::int64_t before = unwrapper.position();
  const auto step = *rc::gen::inRange<std::int64_t>(half, 3 * half);
  unwrapper.add(shown(start + step, singleturn_bits, multiturn_bits, Time(1)));
  RC_ASSERT(unwrapper.position() - before == step - 2 * half);
}

RC_GTEST_PROP(UnwrapProperty, TheLongestGapKeepsWithinThatLimit, ()) {
  const auto [singleturn_bits, multiturn_bits] = any_resolution();
  const auto rpm = *rc::gen::inRange<std::uint32_t>(1, 100'000);
  const Time gap = longest_gap({singleturn_bits, multiturn_bits}, {.rpm = rpm});
  // Counts that the shaft moves in a nanosecond at the speed limit.
  const double counts = std::ldexp(1.0, static_cast<int>(singleturn_bits)) * rpm / 60e9;
  const auto half = static_cast<double>(Counter{singleturn_bits, multiturn_bits}.half());
  RC_ASSERT(counts * static_cast<double>(gap.count()) < half);
  RC_ASSERT(counts * static_cast<double>(gap.count() + 2) >= half * 0.9);
}

// The integer arithmetic of Reach rounds a distance up by at most 2^-29 of its value.
RC_GTEST_PROP(ReachProperty, EqualsDistanceAtHighestSpeed, ()) {
  const auto bits = *rc::gen::inRange(1u, 65u);
  const auto speed = *rc::gen::inRange<std::uint32_t>(1, 1'000'001);
  const auto time = *rc::gen::inRange<std::int64_t>(0, std::int64_t{1} << *rc::gen::inRange(1, 63));
  const double unit_um = *rc::gen::element(0.0, 0.001, 0.05, 1.0, 10.0);
  const SpeedLimit limit{.rpm = speed, .mm_s = speed};
  const std::uint64_t counts = Reach::of(limit, {bits, 0, unit_um}).counts(Time(time), bits);
  const double each = unit_um > 0 ? speed / unit_um / 1e6 : std::ldexp(speed / 60e9, static_cast<int>(bits));
  const double wanted = each * static_cast<double>(time);
  constexpr double most = 0x1p64;
  RC_ASSERT(static_cast<double>(counts) >= std::min(wanted, most) * (1 - 1e-9) - 1);
  RC_ASSERT(static_cast<double>(counts) <= wanted * (1 + 0x1p-29) + 1);
}

/// Returns any number of `bits` bits or fewer, in which small and great numbers are equally frequent.
std::uint64_t any_number(unsigned bits) {
  const auto shift = *rc::gen::inRange(64 - bits, 64u);
  return *rc::gen::weightedOneOf<std::uint64_t>(
             {{8, rc::gen::arbitrary<std::uint64_t>()}, {1, rc::gen::just(~std::uint64_t{0})}}) >>
         shift;
}

RC_GTEST_PROP(ReachProperty, EqualsDistanceAtExtremeSpeedsAndUnits, ()) {
  const auto speed = static_cast<std::uint32_t>(any_number(32));
  const auto time = static_cast<std::int64_t>(any_number(63));
  const auto bits = *rc::gen::inRange(1u, 65u);
  const double unit_um = *rc::gen::element(0.0, 1e-200, 1e-30, 1e-9, 0.3, 1e9, 1e30, 1e200);
  const std::uint64_t counts = Reach::of({.rpm = speed, .mm_s = speed}, {bits, 0, unit_um}).counts(Time(time), bits);
  const double each = unit_um > 0 ? speed / unit_um / 1e6 : std::ldexp(speed / 60e9, static_cast<int>(bits));
  const double wanted = std::min(each * static_cast<double>(time), 0x1p64);
  RC_ASSERT(static_cast<double>(counts) >= wanted * (1 - 1e-14) - 1);
  RC_ASSERT(static_cast<double>(counts) <= wanted * (1 + 0x1p-29));
}

RC_GTEST_PROP(UnwrapProperty, JoinsWithinTheLongestGap, ()) {
  const double unit_um = *rc::gen::element(0.0, 0.001, 0.05, 1.0, 10.0);
  const auto bits = *rc::gen::inRange(1u, 33u);
  const unsigned turn_bits = unit_um > 0 ? 0 : *rc::gen::inRange(0u, 17u);
  const auto speed = static_cast<std::uint32_t>(any_number(32));
  const SpeedLimit limit{.rpm = speed, .mm_s = speed};
  const Time gap = longest_gap({bits, turn_bits, unit_um}, limit);
  const auto joins = [&](double pause) {
    Unwrapper unwrapper(limit);
    Reading reading = shown(0, bits, turn_bits, Time{});
    reading.unit_um = unit_um;
    unwrapper.add(reading);
    reading.latched = Time(static_cast<std::int64_t>(std::min(pause, 0x1p58)));
    return unwrapper.add(reading) == Unwrapper::Joined::continued;
  };
  const auto longest = static_cast<double>(gap.count());
  RC_ASSERT(joins(longest * (1 - 0x1p-27) - 2));
  if (longest < 0x1p57) RC_ASSERT(!joins(longest * (1 + 0x1p-27) + 2));
}

// Unwrapper, which calculates with integers, must find the same jumps as a calculation with floating point.
RC_GTEST_PROP(UnwrapProperty, JumpsFromFourTimesTheSpeedLimitOn, ()) {
  const auto bits = *rc::gen::inRange(8u, 64u);
  const auto speed = static_cast<std::uint32_t>(any_number(32));
  const double unit_um = *rc::gen::element(0.0, 0.001, 0.05, 1.0, 10.0);
  const SpeedLimit limit{.rpm = speed, .mm_s = speed};
  const Resolution resolution{bits, 0, unit_um};
  const std::int64_t longest = longest_gap(resolution, limit).count() / 2;
  const Time pause(*rc::gen::inRange<std::int64_t>(0, std::min<std::int64_t>(longest, 100'000'000) + 1));
  const double most =
      4 * counts_per_second(resolution, limit) * std::chrono::duration<double>(pause + Time(1'000'000)).count() + 4;
  const double half = std::ldexp(0.5, static_cast<int>(bits));
  const auto jumps = [&](double distance) {
    Unwrapper unwrapper(limit);
    Reading reading = shown(0, bits, 0, Time{});
    reading.unit_um = unit_um;
    unwrapper.add(reading);
    reading.singleturn = static_cast<std::uint64_t>(distance) & low_mask(bits);
    reading.latched = pause;
    return unwrapper.jumps(reading);
  };
  if (most < half - 1) {
    RC_ASSERT(!jumps(std::floor(most * (1 - 1e-14))));
    const double beyond = most * (1 + 0x1p-28) + 1;
    if (beyond < half) RC_ASSERT(jumps(beyond));
  } else {
    RC_ASSERT(!jumps(half - 1));
  }
}

/// Expects that the speed computed with integers and the speed computed with floating point agree within the rounding
/// errors that `Velocity::speed` states.
void expect_same_speed(const Velocity& velocity) {
  const MilliSpeed speed = velocity.speed();
  const auto whole = static_cast<double>(speed.speed), around = static_cast<double>(speed.uncertainty);
  const double real = velocity.counts_per_second() * 1000, real_around = velocity.uncertainty() * 1000;
  if (speed.uncertainty == MilliSpeed::most) {
    RC_ASSERT((std::abs(whole) == 0x1p63 || whole == 0));
    RC_ASSERT(std::abs(real) + real_around >= 0x1p63 * (1 - 0x1p-29));
    return;
  }
  constexpr double exact = 1e-14;  // relative rounding error of the calculation with floating point
  const double greatest = std::abs(real) + real_around;
  // The interval computed with integers contains the interval computed with floating point.
  RC_ASSERT(whole - around <= real - real_around + greatest * exact);
  RC_ASSERT(whole + around >= real + real_around - greatest * exact);
  RC_ASSERT(std::abs(whole - real) <= greatest * 0x1p-29 + 2);
  RC_ASSERT(around - real_around <= greatest * 0x1p-29 + 2);
}

RC_GTEST_PROP(VelocityProperty, IntegersEqualRealNumbers, ()) {
  Velocity velocity(Time(static_cast<std::int64_t>(any_number(63))));
  auto at = static_cast<std::int64_t>(any_number(61));
  if (*rc::gen::arbitrary<bool>()) at = -at;
  const std::int64_t end = at + (std::int64_t{1} << 58);
  for (int i = 0; i < 60; ++i) {
    const auto width = static_cast<std::int64_t>(*rc::gen::arbitrary<bool>() ? 0 : any_number(57));
    const std::uint64_t position = any_number(64);
    velocity.add(static_cast<std::int64_t>(position), {Time(at), Time(std::min(at + width, end))});
    expect_same_speed(velocity);
    at = std::min(at + static_cast<std::int64_t>(any_number(55)), end);
  }
}

RC_GTEST_PROP(VelocityProperty, IntegersEqualRealNumbersInOneWindow, ()) {
  Velocity velocity(Time(1));
  const auto from = static_cast<std::int64_t>(any_number(64)), to = static_cast<std::int64_t>(any_number(64));
  const auto pause = 1 + static_cast<std::int64_t>(any_number(57));
  const Time open(pause / 50);
  velocity.add(from, {-open, open});
  velocity.add(to, {Time(pause) - open, Time(pause) + open});
  expect_same_speed(velocity);
}

RC_GTEST_PROP(VelocityProperty, EqualsSpeedInMiddleOfWindow, ()) {
  // `speed` is in counts/s, `acceleration` in counts/s^2. Each reading is late by a random time, at most half a period.
  const double speed = *rc::gen::inRange(-100'000'000, 100'000'000);
  const double acceleration = *rc::gen::inRange(-100'000'000, 100'000'000);
  const auto period = *rc::gen::inRange<std::int64_t>(100'000, 20'000'000);
  const auto at_time = [=](double seconds) { return speed * seconds + acceleration * seconds * seconds / 2; };
  Velocity velocity;
  for (std::int64_t i = 0; i < 100; ++i) {
    const Time at(i * period + *rc::gen::inRange<std::int64_t>(0, period / 2));
    const double seconds = std::chrono::duration<double>(at).count();
    velocity.add(static_cast<std::int64_t>(std::floor(at_time(seconds))), at);
    if (!velocity.valid()) continue;
    const double delay = std::chrono::duration<double>(velocity.delay()).count();
    const double wanted = speed + acceleration * (seconds - delay);
    RC_ASSERT(std::abs(velocity.counts_per_second() - wanted) <=
              velocity.uncertainty() + 1e-6 * std::abs(wanted) + 1e-3);
    RC_ASSERT(velocity.uncertainty() <= 1 / (2 * delay) * (1 + 1e-9) + 1e-9);
    RC_ASSERT(velocity.delay() <= std::chrono::milliseconds(520));
  }
}

RC_GTEST_PROP(VelocityProperty, OfUnwrappedTurnIsValidUpToHalfATurnPerStep, ()) {
  constexpr unsigned bits = 17;
  constexpr double revolution = 1 << bits;
  const auto period = *rc::gen::inRange<std::int64_t>(100'000, 20'000'000);
  // speed in counts/s at which the shaft moves half a turn per reading
  const double limit = revolution / 2 * 1e9 / static_cast<double>(period);
  const auto measured = [&](double speed) {
    Unwrapper unwrapper(SpeedLimit{.rpm = 0});
    Velocity velocity;
    for (std::int64_t i = 0; i < 50; ++i) {
      const auto position = static_cast<std::int64_t>(std::floor(speed * static_cast<double>(i * period) / 1e9));
      unwrapper.add(shown(position, bits, 0, Time(i * period)));
      velocity.add(unwrapper.position(), Time(i * period));
    }
    return velocity.counts_per_second();
  };
  const double share = *rc::gen::inRange(-999, 1000) / 1000.0;
  const double count = 1e9 / static_cast<double>(period);
  RC_ASSERT(std::abs(measured(share * limit) - share * limit) <= count);
  // Between one and two times the speed of half a turn per reading, the shaft seems to turn in the opposite direction.
  const double above = *rc::gen::inRange(1001, 2000) / 1000.0;
  RC_ASSERT(std::abs(measured(above * limit) - (above - 2) * limit) <= count);
}

}  // namespace
}  // namespace absenc::host
