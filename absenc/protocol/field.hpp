// SPDX-License-Identifier: Apache-2.0
// Types for the named values (fields) of a decoded frame.
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
  std::string_view name;     ///< name of the flag; "": the bit is no flag
  std::string_view meaning;  ///< meaning of the set bit, as a phrase
  /// Action for the operator, with commands as "`absenc clear-alarms`"; "": none.
  std::string_view action;
  bool optional = false;  ///< true: some encoders that report the other flags never report this one
  /// For a status flag: bits of the unit's alarms whose occurrence this one bit reports; 0: none.
  std::uint32_t sums = 0;
};

/// Advice to the user for an error, or for a status flag, whose cause the alarms of the encoder name.
inline constexpr std::string_view read_the_alarms = "`absenc alarms` names the cause";

/// Description of a field, which is a named value in requests, replies or results.
struct FieldInfo {
  /// Type of the field's value.
  enum class Kind : std::uint8_t {
    number,
    counts,  ///< unsigned number of up to 64 bits, stored in the 64 bits of FieldValue::number
    boolean,
    flags,  ///< number whose bit n is described by `flags[n]`
    real,
    text,   ///< text of ASCII characters
    bytes,  ///< several bytes, shown in hexadecimal
  };
  std::string_view name;              ///< Name of the field, in `snake_case`.
  Kind kind;                          ///< Type of the field's value.
  std::string_view unit;              ///< unit of the value: "counts", "revolutions", "degC" ...; "" for a plain number
  std::string_view meaning;           ///< Meaning of the value, as a phrase.
  std::span<const FlagInfo> flags{};  ///< kind flags: descriptions of the bits, from bit 0 on
  Role role = Role::other;            ///< Role by which programs that do not know the unit find the field.
  /// True: texts show the number in hexadecimal.
  bool in_hex = false;
};

/// A field together with its value.
struct FieldValue {
  const FieldInfo* info;    ///< Description of the field.
  std::int64_t number = 0;  ///< value of a field of kind number, counts, boolean or flags
  double real = 0;          ///< value of a field of kind real
  Bytes bytes{};            ///< value of a field of kind text or bytes; valid during the call of `put`
};

/// Receiver to which decoders deliver the values of fields, one by one.
struct FieldSink {
  /// Takes the value of one field.
  constexpr virtual void put(const FieldValue& value) = 0;
  /// Takes a reading; a decoder may deliver the same reading twice. By default does nothing.
  constexpr virtual void put_reading(const Reading&) {}

 protected:
  constexpr ~FieldSink() = default;
};

/// A sink that ignores all fields, for callers that only check a frame.
struct NoFields final : FieldSink {
  /// Ignores the value of a field.
  constexpr void put(const FieldValue&) override {}
};

}  // namespace absenc
