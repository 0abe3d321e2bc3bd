// SPDX-License-Identifier: Apache-2.0
// Frames of any link that own their bytes, what a unit makes of them, and what its options can be.
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

/// A frame of whichever link. Its elements are what can be missing at its end: bytes; bits on clocked links.
struct Held {
  LinkKind link{};
  Wire bytes{};
  std::size_t bits = 0;
  std::optional<CanFrame> can{};

  [[nodiscard]] bool empty() const { return bytes.empty() && !can; }
  [[nodiscard]] Frame frame() const { return {.bytes = bytes, .bits = bits, .can = can ? &*can : nullptr}; }
  [[nodiscard]] std::size_t elements() const;
  [[nodiscard]] std::size_t bit_count() const;
  /// The first `count` elements.
  [[nodiscard]] Held cut(std::size_t count) const;
  /// With one bit inverted, counted as for Unit::is_checked.
  [[nodiscard]] Held flipped(std::size_t bit) const;
  /// With these bytes before and behind it; bytes only.
  [[nodiscard]] Held between(Bytes before, Bytes after) const;
};

/// The frame behind a vector's request or reply.
[[nodiscard]] Held held(const Unit& unit, Bytes text);

/// One field. Real numbers as float: what differs by rounding is the same.
struct Value {
  std::int64_t number = 0;
  float real = 0;
  std::string bytes{};
  Role role = Role::other;

  friend bool operator==(const Value& one, const Value& other) {
    return one.number == other.number && one.real == other.real && one.bytes == other.bytes;
  }
};

/// Everything that was put, by name; of several with one name, as of scans, the later ones behind a number.
struct Seen final : FieldSink {
  void put(const FieldValue& value) override;
  void put_reading(const Reading& one) override {
    reading = one;
    ++readings;
  }
  /// Whether a position or turns are there.
  [[nodiscard]] bool has_position() const;
  /// The numbers of this role.
  [[nodiscard]] std::vector<std::int64_t> numbers(Role role) const;

  std::map<std::string, Value> fields;
  std::optional<Reading> reading;
  unsigned readings = 0;
};

[[nodiscard]] std::map<std::string, Value> expected_fields(const Vector& vector);

/// Options as "name=value name=value"; none when they cannot be resolved.
[[nodiscard]] std::optional<Options> options_of(const Unit& unit, std::string_view text);

/// A way in which an encoder can be: what was said to get there, and what became of it.
struct Configuration {
  std::string text;
  Options options;
  bool is_model = false;
};
/// Each model, and each choice of each option and each end of its range beside the first model. None is there twice.
[[nodiscard]] std::vector<Configuration> configurations(const Unit& unit);

using Values = std::vector<std::int64_t>;
/// Defaults, and the least of what is required.
[[nodiscard]] Values least_arguments(const Command& command);
[[nodiscard]] Values most_arguments(const Command& command);
/// Each anywhere in its range, at an end of it more often than elsewhere.
[[nodiscard]] Values random_arguments(const Command& command, sim::Random& random);
/// What the request of a command has, or why it has none.
[[nodiscard]] Result<Wire> encoded(const Unit& unit, const Options& options, const Command& command, Arguments values);

[[nodiscard]] std::string to_text(Bytes bytes);
[[nodiscard]] std::string to_text(const Held& frame);
[[nodiscard]] std::string to_text(const std::map<std::string, Value>& fields);
[[nodiscard]] std::string to_text(Arguments values);

}  // namespace absenc::kit
