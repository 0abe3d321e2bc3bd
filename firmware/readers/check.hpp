// SPDX-License-Identifier: Apache-2.0
// Firmware that gives readings to one part of absenc/host, for measurements. A class for a part has `feed`, which takes
// a reading, and `next`, which returns whether there is a result.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <new>

#include "absenc/core/angle.hpp"
#include "firmware/machine/machine.hpp"
#include "firmware/readers/conversation.hpp"
#ifdef ABSENC_UNIT
#include "firmware/readers/counted.hpp"
#endif

namespace absenc::firmware {

/// Returns a reading of `position` that was latched at most `open` before `at`. The function is not inlined, so that
/// the compiler cannot evaluate readings in advance.
[[gnu::noinline]] inline Reading reading_of(std::uint64_t position, unsigned bits, unsigned turns, double unit_um,
                                            Time at, Time open) {
  return {.singleturn = position & low_mask(bits),
          .multiturn = bits < 64 ? position >> bits & low_mask(turns) : 0,
          .singleturn_bits = bits,
          .multiturn_bits = turns,
          .singleturn_valid_bits = bits,
          .multiturn_valid = turns != 0,
          .unit_um = unit_um,
          .latched = at - open,
          .received = at};
}

#ifdef ABSENC_UNIT

/// An encoder that moves at a constant speed, and jumps now and then.
struct Motion {
  unsigned bits;
  unsigned turns;
  double unit_um;
  Time period;
  std::uint64_t speed;  // speed in counts per period, as a fixed-point number with 16 binary places, modulo 2^64
  Time open;            // greatest uncertainty of the time at which a reading was latched
};

/// Gives readings of many motions to a part of absenc/host, then ends the emulator.
template <class Part>
[[noreturn]] void run() {
  using std::chrono::microseconds, std::chrono::milliseconds, std::chrono::seconds;
  constexpr unsigned readings = 300;
  static constexpr auto widths =
      std::to_array<std::array<unsigned, 2>>({{17, 16}, {23, 0}, {32, 16}, {48, 16}, {64, 0}});
  static constexpr auto units = std::to_array<double>({0, 0.05});
  static constexpr auto periods =
      std::to_array<Time>({microseconds(50), milliseconds(1), milliseconds(70), seconds(9)});
  static constexpr auto speeds =
      std::to_array<std::uint64_t>({0, 99, 0x10000, 0 - std::uint64_t{0x1234'5678}, 1ull << 45});
  // divisors of the period: period divided by divisor is the uncertainty of the latch time; 0: there is no uncertainty
  static constexpr auto uncertainties = std::to_array<std::int64_t>({0, 8, 1});
  static Counted<Part> part;
  std::uint32_t random = 1;
  std::uint32_t results = 0;
  const auto run_motion = [&](const Motion& motion) {
    part.make();
    std::uint64_t place = 0;
    for (unsigned i = 1; i <= readings; ++i) {
      random = random * 1'664'525 + 1'013'904'223;
      place += motion.speed;
      if (random >> 24 == 0) place += std::uint64_t{random} << 24;
      const Time open(motion.open.count() / 256 * (random >> 24));
      part.feed(reading_of(place >> 16, motion.bits, motion.turns, motion.unit_um, i * motion.period, open));
      if (part.next(Time{})) ++results;
    }
  };
  for (const auto& [bits, turns] : widths) {
    for (const double unit_um : units) {
      for (const Time period : periods) {
        for (const std::uint64_t speed : speeds) {
          for (const std::int64_t share : uncertainties) {
            run_motion({bits, unit_um > 0 ? 0 : turns, unit_um, period, speed, share == 0 ? Time{} : period / share});
          }
        }
      }
    }
  }
  machine::print(results);
  machine::end(results != 0);
}

#else

/// Gives a few readings of a shaft to a part of absenc/host and measures the part, then ends the emulator.
template <class Part>
[[noreturn]] void run() {
  alignas(Part) static std::byte memory[sizeof(Part)];
  machine::paint_stack();
  bool good = false;
  count_begin();
  Part& part = *new (memory) Part;
  for (unsigned i = 1; i <= 4; ++i) {
    const Reading reading = reading_of(1000 * i, 17, 16, 0, Time(1'000'000) * i, Time(4000));
    count_begin();
    part.feed(reading);
    good = part.next(Time{});
    count_end();
  }
  count_end();
  machine::print(machine::stack_used());
  machine::end(good);
}

#endif

}  // namespace absenc::firmware
