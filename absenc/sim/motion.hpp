// SPDX-License-Identifier: Apache-2.0
// How a virtual encoder's shaft moves: still, at constant speed, as a sine, or as a file says.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string_view>
#include <variant>
#include <vector>

#include "absenc/core/shaft.hpp"

namespace absenc::sim {

/// A value: copies move alike and independently. Positions are in 2^-32 revolution and have no error that grows
/// with time. After 2^31 revolutions the position wraps.
class Motion final : public Shaft {
 public:
  /// A point of a path: where the shaft is, relative to the start position, at that time.
  struct Knot {
    Time time;
    std::int64_t position;
  };

  [[nodiscard]] static Motion still(std::int64_t start);
  /// -1 000 000 to 1 000 000 revolutions a minute, kept to 1e-6. Throws std::invalid_argument when outside.
  [[nodiscard]] static Motion constant_speed(std::int64_t start, double rpm);
  /// start + amplitude * sin(2 pi frequency t): up to 36 000 000 degrees and 10 000 Hz, kept to 1e-6 Hz.
  /// Throws std::invalid_argument when outside.
  [[nodiscard]] static Motion sine(std::int64_t start, double amplitude_degrees, double frequency_hz);
  /// Straight lines between `seconds,degrees` (relative to `start`), one a line, seconds rising; standing still before
  /// the first and after the last. Lines that begin with # are skipped, and a heading. Throws std::invalid_argument
  /// with `name` and the line that is wrong.
  [[nodiscard]] static Motion path(std::int64_t start, std::istream& csv, std::string_view name);

  /// Lets the shaft stand at its start until then, and move behind it; 0 if this is not called, before which it moves
  /// too.
  void begin_at(Time time) {
    begin_ = time;
    rests_before_ = true;
  }

  [[nodiscard]] ShaftState at(Time time) const override;

 private:
  struct Still {};
  struct ConstantSpeed {
    std::int64_t micro_rpm;
  };
  struct Sine {
    double amplitude;  // revolutions
    std::uint64_t micro_hertz;
  };
  struct Path {
    std::vector<Knot> knots;  // at least one
  };
  using Kind = std::variant<Still, ConstantSpeed, Sine, Path>;

  Motion(std::int64_t start, Kind kind);
  static ShaftState offset_at(const Still& still, Time time);
  static ShaftState offset_at(const ConstantSpeed& speed, Time time);
  static ShaftState offset_at(const Sine& sine, Time time);
  static ShaftState offset_at(const Path& path, Time time);

  std::int64_t start_;
  Time begin_{};
  bool rests_before_ = false;
  Kind kind_;
};

/// `still`, `rpm=R`, `sine=DEGREES,HZ` or `file=CSV` (opened and read here). Throws std::invalid_argument with a
/// sentence that says what is wrong and what is allowed.
[[nodiscard]] Motion parse_motion(std::string_view text, std::int64_t start_position);

}  // namespace absenc::sim
