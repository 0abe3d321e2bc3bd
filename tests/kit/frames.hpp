// SPDX-License-Identifier: Apache-2.0
// Frames of any link type that own their bytes, the fields that a unit decodes from them, and the configurations of a
// unit that the tests use.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::kit {

using Wire = std::vector<std::uint8_t>;

/// A frame of any link type that owns its bytes. Its elements, counted by `elements`, are bytes, or bits on a clocked
/// link.
struct OwnedFrame {
  LinkKind link{};
  Wire bytes{};
  std::size_t bits = 0;
  std::optional<CanFrame> can{};

  [[nodiscard]] bool empty() const { return bytes.empty() && !can; }
  [[nodiscard]] Frame frame() const { return {.bytes = bytes, .bits = bits, .can = can ? &*can : nullptr}; }
  [[nodiscard]] std::size_t elements() const;
  [[nodiscard]] std::size_t bit_count() const;
  /// Returns the first `count` elements of the frame.
  [[nodiscard]] OwnedFrame cut(std::size_t count) const;
  /// Returns the frame with one bit inverted. Bits are numbered as for `Unit::is_checked`.
  [[nodiscard]] OwnedFrame flipped(std::size_t bit) const;
  /// Returns the frame with extra bytes before and after it. Only for links that carry bytes.
  [[nodiscard]] OwnedFrame between(Bytes before, Bytes after) const;
};

/// Returns the frame that a vector's request or reply describes.
[[nodiscard]] OwnedFrame frame_of(const Unit& unit, Bytes text);

/// Value of one field. A real number is a float, so that values which differ only by rounding are equal.
struct Value {
  std::int64_t number = 0;
  float real = 0;
  std::string bytes{};
  Role role = Role::other;

  friend bool operator==(const Value& one, const Value& other) {
    return one.number == other.number && one.real == other.real && one.bytes == other.bytes;
  }
};

/// Stores every field that a decoder reports, by name. A repeated name, as in a scan, gets a number from the second
/// time on.
struct ReportedFields final : FieldSink {
  void put(const FieldValue& value) override;
  void put_reading(const Reading& one) override {
    reading = one;
    ++readings;
  }
  /// Returns whether the fields include a position or turns.
  [[nodiscard]] bool has_position() const;
  /// Returns the values of all fields with this role.
  [[nodiscard]] std::vector<std::int64_t> numbers(Role role) const;

  std::map<std::string, Value> fields;
  std::optional<Reading> reading;
  unsigned readings = 0;
};

[[nodiscard]] std::map<std::string, Value> expected_fields(const Vector& vector);

/// Parses options of the form "name=value name=value". Returns nothing if the unit does not accept them.
[[nodiscard]] std::optional<Options> options_of(const Unit& unit, std::string_view text);

/// One configuration of a unit that the tests use: a text that names it, and its options.
struct Configuration {
  std::string text;
  Options options;
  bool is_model = false;
};
/// Returns each model; and the first model with each choice of each option and with the minimum and maximum of each
/// option. None is repeated.
[[nodiscard]] std::vector<Configuration> configurations(const Unit& unit);

using Values = std::vector<std::int64_t>;
/// Returns the default of each optional argument and the minimum of each required one.
[[nodiscard]] Values least_arguments(const Command& command);
[[nodiscard]] Values most_arguments(const Command& command);
/// Returns a random value in the range of each argument. A quarter of the values lie at an end of the range.
[[nodiscard]] Values random_arguments(const Command& command, sim::Random& random);
/// Returns the bytes of the command's request, or the error of `encode`.
[[nodiscard]] Result<Wire> encoded(const Unit& unit, const Options& options, const Command& command, Arguments values);

[[nodiscard]] std::string to_text(Bytes bytes);
[[nodiscard]] std::string to_text(const OwnedFrame& frame);
[[nodiscard]] std::string to_text(const std::map<std::string, Value>& fields);
[[nodiscard]] std::string to_text(Arguments values);

}  // namespace absenc::kit
