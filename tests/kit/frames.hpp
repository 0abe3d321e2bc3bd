// SPDX-License-Identifier: Apache-2.0
// Types of the kit: frames that own their bytes, decoded fields, and configurations of a unit.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::kit {

using Wire = std::vector<std::uint8_t>;

/// A frame of any link type that owns its bytes. Its elements are bits on a clocked link, else bytes.
struct OwnedFrame {
  LinkKind link{};
  Wire bytes{};
  std::size_t bits = 0;
  std::optional<CanFrame> can{};

  [[nodiscard]] bool empty() const { return bytes.empty() && !can; }
  [[nodiscard]] Frame frame() const { return {.bytes = bytes, .bits = bits, .can = can ? &*can : nullptr}; }
  [[nodiscard]] std::size_t elements() const;
  [[nodiscard]] std::size_t bit_count() const;
  /// Returns the first `count` elements of this frame as a frame.
  [[nodiscard]] OwnedFrame cut(std::size_t count) const;
  /// Appends bits to a frame of bits.
  void append(BitView more);
  /// Returns the frame with one bit inverted, numbered as in `Unit::is_checked`.
  [[nodiscard]] OwnedFrame flipped(std::size_t bit) const;
  /// Returns the frame with additional bytes before and after its own. Only for links that carry bytes.
  [[nodiscard]] OwnedFrame between(Bytes before, Bytes after) const;
};

/// Returns the frame that a test vector states as its request or reply in `text`.
[[nodiscard]] OwnedFrame frame_of(const Unit& unit, Bytes text);

/// Value of one field; real numbers are compared as floats.
struct Value {
  std::int64_t number = 0;
  float real = 0;
  std::string bytes{};
  Role role = Role::other;

  friend bool operator==(const Value& one, const Value& other) {
    return one.number == other.number && one.real == other.real && one.bytes == other.bytes;
  }
};

/// Stores every field that a decoder reports, by its name. If a name is repeated, a number is added to it.
struct ReportedFields final : FieldSink {
  void put(const FieldValue& value) override;
  void put_reading(const Reading& one) override {
    reading = one;
    ++readings;
  }
  /// Returns whether the fields include a position or turns.
  [[nodiscard]] bool has_position() const;
  /// Returns the values of all fields with this role, or an empty list.
  [[nodiscard]] std::vector<std::int64_t> numbers(Role role) const;

  std::map<std::string, Value> fields;
  std::optional<Reading> reading;
  unsigned readings = 0;
};

[[nodiscard]] std::map<std::string, Value> expected_fields(const Vector& vector);

/// Returns the options in a text "name=value name=value", or no value if the unit refuses them.
[[nodiscard]] std::optional<Options> options_of(const Unit& unit, std::string_view text);

/// One configuration of a unit that the tests use: its options, and a text that names it.
struct Configuration {
  std::string text;
  Options options;
  bool is_model = false;
};
/// Returns the configurations of the unit's models (of its defaults, if it has no models), then variants of the first
/// one in which one option has another value.
[[nodiscard]] std::vector<Configuration> configurations(const Unit& unit);

using Values = std::vector<std::int64_t>;
/// Returns the default of each optional argument and the minimum of each required one.
[[nodiscard]] Values least_arguments(const Command& command);
[[nodiscard]] Values most_arguments(const Command& command);
/// Returns random arguments within their ranges; minima and maxima are frequent.
[[nodiscard]] Values random_arguments(const Command& command, sim::Random& random);
/// Returns the bytes of the command's request, or the error of `Unit::encode`.
[[nodiscard]] Result<Wire> encoded(const Unit& unit, const Options& options, const Command& command, Arguments values);

[[nodiscard]] std::string to_text(Bytes bytes);
[[nodiscard]] std::string to_text(const OwnedFrame& frame);
[[nodiscard]] std::string to_text(const std::map<std::string, Value>& fields);
[[nodiscard]] std::string to_text(Arguments values);

}  // namespace absenc::kit
