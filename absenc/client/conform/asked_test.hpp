// SPDX-License-Identifier: Apache-2.0
// Addresses of encoders, and names of tests, that the conformance tests share.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "absenc/client/conform.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

/// Parses the address. If the encoder sends unsolicited frames, selects an option with which it is polled, if there is
/// one.
inline EncoderAddress polled_address(const std::string& text) {
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

/// Returns several addresses of the unit's virtual encoder: one with the default options, and others in which options
/// have other values.
inline std::vector<EncoderAddress> variations_of(const Unit& unit) {
  std::vector<EncoderAddress> all{parse_address(fmt::format("sim:{}", unit.id))};
  const auto add = [&](const Option& option, std::int64_t value) {
    try {
      const std::string text = fmt::format("sim:{}?{}={}", unit.id, option.name, to_text(option, value));
      EncoderAddress address = parse_address(text);
      const VirtualDevice device(unit, address.options, address.device);
      all.push_back(std::move(address));
    } catch (const UsageError&) {  // leaves out an option value that no virtual encoder can have
    }
  };
  for (const Option& option : unit.options) {
    for (std::size_t i = 0; i < option.choices.size(); ++i) add(option, static_cast<std::int64_t>(i));
    if (!option.choices.empty()) continue;
    for (const std::int64_t value :
         {option.minimum, option.maximum, option.default_value - option.step, option.default_value + option.step}) {
      if (value >= option.minimum && value <= option.maximum && value != option.default_value) add(option, value);
    }
  }
  return all;
}
/// Returns a name for the options of the address: the unit's identifier and the first option that differs from its
/// default, if any.
inline std::string variation_name(const EncoderAddress& address) {
  const EncoderAddress usual = parse_address(fmt::format("sim:{}", address.unit->id));
  for (std::size_t i = 0; i < address.unit->options.size(); ++i) {
    const Option& option = address.unit->options[i];
    const std::int64_t value = address.options.values[i];
    if (value != usual.options.values[i])
      return fmt::format("{} {}={}", address.unit->id, option.name, to_text(option, value));
  }
  return std::string(address.unit->id);
}

/// Returns the unit's identifier as the name of a test, with '_' in place of '-'.
inline std::string test_name(const Unit& unit) {
  std::string name(unit.id);
  for (char& letter : name) letter = letter == '-' ? '_' : letter;
  return name;
}

inline bool all_kept(const Conformance& conformance) {
  return conformance.left.empty() && conformance.count(Verdict::kept) == conformance.clauses.size();
}

}  // namespace absenc::client
