// SPDX-License-Identifier: Apache-2.0
// What tests of conform need of every unit.
#pragma once

#include <fmt/format.h>

#include <string>

#include "absenc/client/conform.hpp"
#include "absenc/client/way/address.hpp"

namespace absenc::client {

/// The encoder of this address; where it sends by itself, with the first choice of an option with which it is asked.
inline EncoderAddress asked_address(const std::string& text) {
  const EncoderAddress usual = parse_address(text);
  const Unit& unit = *usual.unit;
  if (unit.streams == nullptr || !unit.streams(usual.options)) return usual;
  for (const Option& option : unit.options) {
    for (const std::string_view choice : option.choices) {
      const EncoderAddress asked = parse_address(
          fmt::format("{}{}{}={}", text, text.find('?') == std::string::npos ? '?' : '&', option.name, choice));
      if (!unit.streams(asked.options)) return asked;
    }
  }
  return usual;
}

inline bool all_kept(const Conformance& conformance) {
  return conformance.left.empty() && conformance.count(Verdict::kept) == conformance.clauses.size();
}

}  // namespace absenc::client
