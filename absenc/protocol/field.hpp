// SPDX-License-Identifier: Apache-2.0
// Named values of a decoded frame: described once as data by the unit, handed out as numbers.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/angle.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/protocol/role.hpp"

namespace absenc {

/// One bit of a status or alarm field.
struct FlagInfo {
  std::string_view name;     ///< "" when the bit has no meaning
  std::string_view meaning;  ///< what has happened
  /// What the operator must do, commands as "`absenc clear-alarms`"; "" when nothing: it is no ailment.
  std::string_view action;
  bool optional = false;   ///< some encoders have no such flag: one that reports the others and not this one has none
  std::uint32_t sums = 0;  ///< of a status flag: the bits of the unit's alarms that it is the sum of; 0: none
};

/// The action of a status flag that only sums up alarms. Who shows the alarms beside it leaves it out.
inline constexpr std::string_view read_the_alarms = "`absenc alarms` names the cause";

/// Description of a value in replies.
struct FieldInfo {
  /// Type of the value.
  enum class Kind : std::uint8_t {
    number,
    counts,  ///< a number of up to 64 bits without sign: the bits of `number`
    boolean,
    flags,  ///< bit n is flags[n]
    real,
    text,   ///< ASCII
    bytes,  ///< shown as hexadecimal
  };
  std::string_view name;              ///< Name of the field, in `snake_case`.
  Kind kind;                          ///< Type of the value.
  std::string_view unit;              ///< "" for a plain number; "counts", "revolutions", "degC" ...
  std::string_view meaning;           ///< Meaning of the value, as a phrase.
  std::span<const FlagInfo> flags{};  ///< Names of the bits, if they are flags.
  Role role = Role::other;            ///< Role by which generic programs find it.
  bool in_hex = false;  ///< a number that documents write in hexadecimal: so do texts, while JSON and CSV have numbers
};

/// Value of a field.
struct FieldValue {
  const FieldInfo* info;    ///< The field.
  std::int64_t number = 0;  ///< number, counts, boolean, flags
  double real = 0;          ///< Value of a field with a fraction.
  Bytes bytes{};            ///< text, bytes; valid during the call of `put`
};

/// Takes the values of fields, one by one.
struct FieldSink {
  /// Takes a value.
  constexpr virtual void put(const FieldValue& value) = 0;
  /// The position in a good reply that carries one, or only its turns, and what of it holds: behind the fields that
  /// show it. May come again with the same.
  constexpr virtual void put_reading(const Reading&) {}

 protected:
  constexpr ~FieldSink() = default;
};

/// For those who ask only whether a frame is good.
struct NoFields final : FieldSink {
  /// Ignores the value.
  constexpr void put(const FieldValue&) override {}
};

}  // namespace absenc
