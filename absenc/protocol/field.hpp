// SPDX-License-Identifier: Apache-2.0
// Named values of a decoded frame: the unit describes them once as data and puts them as numbers.
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
  std::string_view name;     ///< "": the bit has no meaning
  std::string_view meaning;  ///< what happened
  /// Action for the operator, with commands as "`absenc clear-alarms`"; "": none, the flag is no fault.
  std::string_view action;
  bool optional = false;   ///< some encoders lack this flag: those that report the others and never this one
  std::uint32_t sums = 0;  ///< for a status flag: bits of the unit's alarms that it sums up; 0: none
};

/// The action of a status flag that only sums up alarms. Left out where the alarms are shown, too.
inline constexpr std::string_view read_the_alarms = "`absenc alarms` names the cause";

/// Description of a value in replies.
struct FieldInfo {
  /// Type of the value.
  enum class Kind : std::uint8_t {
    number,
    counts,  ///< number of up to 64 bits without sign, in the bits of `number`
    boolean,
    flags,  ///< bit n is flags[n]
    real,
    text,   ///< ASCII text
    bytes,  ///< bytes, shown in hexadecimal
  };
  std::string_view name;              ///< Name of the field, in `snake_case`.
  Kind kind;                          ///< Type of the value.
  std::string_view unit;              ///< "" for a plain number; "counts", "revolutions", "degC" ...
  std::string_view meaning;           ///< Meaning of the value, as a phrase.
  std::span<const FlagInfo> flags{};  ///< Names of the bits, if they are flags.
  Role role = Role::other;            ///< Role by which generic programs find it.
  bool in_hex = false;  ///< texts show the number in hexadecimal, as documents do; JSON and CSV have decimal numbers
};

/// Value of a field.
struct FieldValue {
  const FieldInfo* info;    ///< The field.
  std::int64_t number = 0;  ///< value of kinds number, counts, boolean and flags
  double real = 0;          ///< Value of a field with a fraction.
  Bytes bytes{};            ///< value of kinds text and bytes; valid during the call of `put`
};

/// Takes the values of fields, one by one.
struct FieldSink {
  /// Takes a value.
  constexpr virtual void put(const FieldValue& value) = 0;
  /// Puts the position of a valid reply, or only its turns, with its validity. Called after the fields that show it;
  /// the same reading may come twice.
  constexpr virtual void put_reading(const Reading&) {}

 protected:
  constexpr ~FieldSink() = default;
};

/// A sink that drops all fields, to check a frame only.
struct NoFields final : FieldSink {
  /// Ignores the value.
  constexpr void put(const FieldValue&) override {}
};

}  // namespace absenc
