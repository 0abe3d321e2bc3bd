// SPDX-License-Identifier: Apache-2.0
// The vectors of tests/*.json as vectors.py writes them for a machine that has no file.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"

namespace absenc::firmware {

struct Wanted {
  enum class Kind : std::uint8_t { number, real, text, names } kind;
  std::string_view field;
  std::int64_t number;
  double real;            // of numbers too
  std::string_view text;  // names with blanks between; bytes as hexadecimal
};

struct ReferenceVector {
  std::string_view unit;
  std::string_view id;
  std::string_view options;  // "name=value name=value"
  Bytes request;             // clocked and CAN links: their text
  Bytes reply;
  std::span<const Wanted> fields;
  Error error;
};

[[nodiscard]] std::span<const ReferenceVector> reference_vectors();

}  // namespace absenc::firmware
