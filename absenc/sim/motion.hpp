// SPDX-License-Identifier: Apache-2.0
// Motion of a virtual encoder's shaft: still, constant speed, sine, or a path from a file.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string_view>
#include <variant>
#include <vector>

#include "absenc/core/shaft.hpp"

namespace absenc::sim {

/// The motion of a shaft, as a value. Positions are in 2^-32 revolution and wrap at 2^31 revolutions.
class Motion final : public Shaft {
 public:
  /// A point of a path: position of the shaft at `time`, relative to the start position.
  struct Knot {
    Time time;              ///< time at which the shaft reaches the point
    std::int64_t position;  ///< position relative to the start position, unit 2^-32 revolution
  };

  /// Returns a shaft that stands at `start`, unit 2^-32 revolution.
  [[nodiscard]] static Motion still(std::int64_t start);
  /// Returns a motion at `rpm`, rounded to 1e-6 rpm. Throws std::invalid_argument outside -1 000 000 to 1 000 000 rpm.
  [[nodiscard]] static Motion constant_speed(std::int64_t start, double rpm);
  /// Returns the motion start + amplitude * sin(2 pi frequency t), with the frequency rounded to 1e-6 Hz. Throws
  /// std::invalid_argument outside 0 to 36 000 000 degrees or 0 to 10 000 Hz.
  [[nodiscard]] static Motion sine(std::int64_t start, double amplitude_degrees, double frequency_hz);
  /// Returns a motion in straight lines between points `seconds,degrees`, one per line, seconds rising; degrees are
  /// relative to `start`. Lines that begin with # are skipped. Throws std::invalid_argument, whose text names the file
  /// as `name`.
  [[nodiscard]] static Motion path(std::int64_t start, std::istream& csv, std::string_view name);

  /// Starts the motion at `time`; until then the shaft rests.
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
    double amplitude;  // amplitude of the sine in revolutions
    std::uint64_t micro_hertz;
  };
  struct Path {
    std::vector<Knot> knots;  // points in the order of time, at least one
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

/// Parses `still`, `rpm=R`, `sine=DEGREES,HZ` or `file=CSV`. Throws std::invalid_argument.
[[nodiscard]] Motion parse_motion(std::string_view text, std::int64_t start_position);

}  // namespace absenc::sim
