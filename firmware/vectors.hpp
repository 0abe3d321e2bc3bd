// SPDX-License-Identifier: Apache-2.0
// The vectors of tests/*.json as tables, because the machine has no files.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"

namespace absenc::firmware {

struct ExpectedField {
  enum class Kind : std::uint8_t { number, real, text, names } kind;
  std::string_view field;
  std::int64_t number;
  double real;            // expected value as a real number, set even if the value is whole
  std::string_view text;  // expected text: names of flags separated by blanks, bytes in hexadecimal, or any other text
};

struct ReferenceVector {
  std::string_view unit;
  std::string_view id;
  std::string_view options;  // options: "name=value name=value"
  Bytes request;             // bytes of the request; on clocked and CAN links the characters of its text
  Bytes reply;
  std::span<const ExpectedField> fields;
  Error error;
};

[[nodiscard]] std::span<const ReferenceVector> reference_vectors();

}  // namespace absenc::firmware
