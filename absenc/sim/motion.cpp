// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/motion.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <istream>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace absenc::sim {

namespace {

constexpr double revolution = 4294967296.0;  // number of position units in a revolution: 2^32

struct Quotient {
  std::uint64_t whole;
  std::uint64_t remainder;
};

// Returns quotient and remainder of a * b / divisor. The divisor must be below 2^63.
Quotient multiply_divide(std::uint64_t a, std::uint64_t b, std::uint64_t divisor) {
  const std::uint64_t a_whole = a / divisor;
  const std::uint64_t a_remainder = a % divisor;
  Quotient result{0, 0};
  const auto carry = [&] {
    if (result.remainder < divisor) return;
    result.remainder -= divisor;
    ++result.whole;
  };
  for (int bit = 63; bit >= 0; --bit) {
    result.whole *= 2;
    result.remainder *= 2;
    carry();
    if (((b >> bit) & 1) == 0) continue;
    result.whole += a_whole;
    result.remainder += a_remainder;
    carry();
  }
  return result;
}

std::uint64_t magnitude(std::int64_t value) {
  return value < 0 ? 0 - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
}

// Returns a * b / divisor, rounded towards zero.
std::int64_t scale(std::int64_t a, std::int64_t b, std::uint64_t divisor) {
  const std::uint64_t whole = multiply_divide(magnitude(a), magnitude(b), divisor).whole;
  return static_cast<std::int64_t>((a < 0) != (b < 0) ? 0 - whole : whole);
}

std::int32_t saturated(double value) {
  constexpr double limit = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::lround(std::clamp(value, -limit, limit)));
}

// Returns the number in `text`, or nothing if it is none. Blanks, tabs and CRs around the number are allowed.
std::optional<double> number(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  text = text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

[[noreturn]] void refuse(const std::string& sentence) { throw std::invalid_argument(sentence); }

void check_range(const char* what, double value, double minimum, double maximum) {
  if (value >= minimum && value <= maximum) return;
  const auto text = [](double bound) { return std::to_string(static_cast<long>(bound)); };
  refuse(std::string(what) + " must be from " + text(minimum) + " to " + text(maximum));
}

std::optional<Motion::Knot> knot(std::string_view line) {
  const auto comma = line.find(',');
  if (comma == std::string_view::npos) return {};
  const auto seconds = number(line.substr(0, comma));
  const auto degrees = number(line.substr(comma + 1));
  // With these limits of time and angle, the difference between two points of the path cannot overflow.
  if (!seconds || !degrees || std::abs(*seconds) > 4e9 || std::abs(*degrees) > 3.8e11) return {};
  return Motion::Knot{Time(std::llround(*seconds * 1e9)), std::llround(*degrees / 360 * revolution)};
}

}  // namespace

Motion::Motion(std::int64_t start, Kind kind) : start_(start), kind_(std::move(kind)) {}

Motion Motion::still(std::int64_t start) { return {start, Still{}}; }

Motion Motion::constant_speed(std::int64_t start, double rpm) {
  check_range("the speed in rpm", rpm, -1e6, 1e6);
  return {start, ConstantSpeed{std::llround(rpm * 1e6)}};
}

Motion Motion::sine(std::int64_t start, double amplitude_degrees, double frequency_hz) {
  check_range("the amplitude in degrees", amplitude_degrees, 0, 36e6);
  check_range("the frequency in Hz", frequency_hz, 0, 1e4);
  return {start, Sine{amplitude_degrees / 360, static_cast<std::uint64_t>(std::llround(frequency_hz * 1e6))}};
}

Motion Motion::path(std::int64_t start, std::istream& csv, std::string_view name) {
  constexpr std::size_t longest_line = 1024;
  // Greatest number of points of a path, enough for more than an hour with a thousand points per second.
  constexpr std::size_t most_knots = 4'000'000;
  Path path;
  std::array<char, longest_line + 1> buffer;
  bool heading_allowed = true;
  for (std::size_t line_number = 1; csv.getline(buffer.data(), buffer.size()) || csv.gcount() > 0; ++line_number) {
    if (csv.fail()) refuse(std::string(name) + ", line " + std::to_string(line_number) + ": more than 1024 characters");
    const std::string_view line(buffer.data());
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    const auto place = [&] { return std::string(name) + ", line " + std::to_string(line_number) + ": "; };
    const auto next = knot(line);
    const bool heading = heading_allowed && std::string_view("+-.0123456789").find(line[first]) == std::string::npos;
    heading_allowed = false;
    if (!next && heading) continue;
    if (!next) refuse(place() + "expected `seconds,degrees`, for example `0.5,90`");
    if (!path.knots.empty() && next->time <= path.knots.back().time) {
      refuse(place() + "the seconds must rise from line to line");
    }
    if (path.knots.size() == most_knots) refuse(place() + "more than 4000000 lines");
    path.knots.push_back(*next);
  }
  if (path.knots.empty()) refuse(std::string(name) + ": no line with `seconds,degrees`");
  return {start, std::move(path)};
}

ShaftState Motion::at(Time time) const {
  const bool rests = rests_before_ && time <= begin_;
  const Time since = rests ? Time{} : time - begin_;
  ShaftState state = std::visit([&](const auto& kind) { return offset_at(kind, since); }, kind_);
  if (rests) state.speed_millirpm = state.acceleration = 0;
  state.position =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(start_) + static_cast<std::uint64_t>(state.position));
  return state;
}

ShaftState Motion::offset_at(const Still&, Time) { return {}; }

ShaftState Motion::offset_at(const ConstantSpeed& speed, Time time) {
  // position = micro_rpm * ns * 2^32 / (60 * 1e6 * 1e9). Numerator and denominator are divided by 2^17; both are then
  // whole numbers.
  constexpr std::int64_t numerator = std::int64_t{1} << 15;
  constexpr std::uint64_t denominator = 457'763'671'875;
  return {scale(speed.micro_rpm * numerator, time.count(), denominator),
          saturated(static_cast<double>(speed.micro_rpm) / 1e3), 0};
}

ShaftState Motion::offset_at(const Sine& sine, Time time) {
  // Whole periods of the sine are removed exactly, so that its phase is as accurate after a day as in the first second.
  constexpr std::uint64_t one_period = 1'000'000'000'000'000;  // after a period: time in ns * frequency in micro-hertz
  const auto phase = multiply_divide(sine.micro_hertz, magnitude(time.count()), one_period).remainder;
  const double turn = static_cast<double>(phase) / static_cast<double>(one_period);
  const double angle = 2 * std::numbers::pi * (time.count() < 0 ? -turn : turn);
  // Angular frequency of the sine in rad/s.
  const double angular = 2 * std::numbers::pi * static_cast<double>(sine.micro_hertz) / 1e6;
  const double speed = sine.amplitude * angular * std::cos(angle);  // speed of the shaft in revolutions per second
  const double acceleration = -sine.amplitude * angular * angular * std::sin(angle);
  return {std::llround(sine.amplitude * std::sin(angle) * revolution), saturated(speed * 60e3),
          saturated(acceleration * 2 * std::numbers::pi)};
}

ShaftState Motion::offset_at(const Path& path, Time time) {
  const auto later = std::upper_bound(path.knots.begin(), path.knots.end(), time,
                                      [](Time wanted, const Knot& knot) { return wanted < knot.time; });
  if (later == path.knots.begin()) return {path.knots.front().position, 0, 0};
  if (later == path.knots.end()) return {path.knots.back().position, 0, 0};
  const Knot& from = *std::prev(later);
  const std::int64_t distance = later->position - from.position;
  const auto duration = (later->time - from.time).count();
  const std::int64_t moved = scale(distance, (time - from.time).count(), static_cast<std::uint64_t>(duration));
  const double revolutions_a_second =
      static_cast<double>(distance) / revolution / (static_cast<double>(duration) / 1e9);
  return {from.position + moved, saturated(revolutions_a_second * 60e3), 0};
}

Motion parse_motion(std::string_view text, std::int64_t start_position) {
  const auto equals = text.find('=');
  const std::string_view kind = text.substr(0, equals);
  const std::string_view value = equals == std::string_view::npos ? std::string_view{} : text.substr(equals + 1);
  const std::string quoted = "motion `" + std::string(text) + "`: ";
  try {
    if (kind == "still" && equals == std::string_view::npos) return Motion::still(start_position);
    if (kind == "rpm") {
      const auto rpm = number(value);
      if (!rpm) refuse("rpm= needs a number, for example `rpm=3000`");
      return Motion::constant_speed(start_position, *rpm);
    }
    if (kind == "sine") {
      const auto comma = value.find(',');
      const auto amplitude = number(value.substr(0, comma));
      const auto frequency = number(comma == std::string_view::npos ? "" : value.substr(comma + 1));
      if (!amplitude || !frequency) refuse("sine= needs degrees and Hz, for example `sine=90,0.5`");
      return Motion::sine(start_position, *amplitude, *frequency);
    }
    if (kind == "file") {
      const std::string name(value);
      std::ifstream csv(name);
      if (!csv) refuse("the file cannot be opened");
      return Motion::path(start_position, csv, name);
    }
  } catch (const std::invalid_argument& problem) {
    throw std::invalid_argument(quoted + problem.what());
  }
  refuse(quoted + "unknown; allowed are still, rpm=R, sine=DEGREES,HZ and file=CSV");
}

}  // namespace absenc::sim
