// SPDX-License-Identifier: Apache-2.0
// Declares the options of a unit, each by the member of the format that it sets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "absenc/protocol/options.hpp"

namespace absenc::author {

namespace detail {
template <class Format, class Member>
Format format_of(Member Format::*);
template <class Format, class Member>
Member member_of(Member Format::*);
// Converts the value of a format's member to the value of its option; a duration becomes its number of nanoseconds.
template <class Value>
constexpr std::int64_t number_of(const Value& value) {
  if constexpr (requires { value.count(); }) {
    return value.count();
  } else {
    return static_cast<std::int64_t>(value);
  }
}
// Finds, among the types `One` and `Others`, the one that derives from all others.
template <class One, class... Others>
struct MostDerived {
  using Type = One;
};
template <class One, class Next, class... Others>
struct MostDerived<One, Next, Others...>
    : MostDerived<std::conditional_t<std::is_base_of_v<One, Next>, Next, One>, Others...> {};
}  // namespace detail

/// Description of an option, together with the member of the format that the option sets.
template <auto member>
struct OptionOf {
  /// Format of the encoder: the values of its options.
  using Format = decltype(detail::format_of(member));
  /// C++ type of the format's member that the option sets.
  using Member = decltype(detail::member_of(member));
  Option info;  ///< Description of the option, without the member.

  /// Sets the member of `format` to `value`.
  static constexpr void put(Format& format, std::int64_t value) { format.*member = static_cast<Member>(value); }
  /// Returns the value of the member of `format`.
  [[nodiscard]] static constexpr std::int64_t get(const Format& format) {
    return static_cast<std::int64_t>(format.*member);
  }
};

/// Returns the declaration of a numeric option; its default is the member's initial value.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> option(std::string_view name, std::string_view meaning, std::int64_t minimum,
                                                std::int64_t maximum, std::uint32_t step = 1) {
  const auto value = typename OptionOf<member>::Format{}.*member;
  return {{.name = name,
           .meaning = meaning,
           .default_value = detail::number_of(value),
           .minimum = minimum,
           .maximum = maximum,
           .step = step}};
}

/// Returns the declaration of an option whose value n is `choices[n]`; its default is the member's initial value.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> option(std::string_view name, std::string_view meaning,
                                                std::span<const std::string_view> choices) {
  const auto value = typename OptionOf<member>::Format{}.*member;
  return {{.name = name, .meaning = meaning, .default_value = static_cast<std::int64_t>(value), .choices = choices}};
}

/// Returns the declaration of a boolean option; its default is the member's initial value.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> option(std::string_view name, std::string_view meaning) {
  return option<member>(name, meaning, std::span<const std::string_view>(boolean_choices));
}

/// Returns the option `one`, marked as one whose value captured frames can show.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> probeable(OptionOf<member> one) {
  one.info.probeable = true;
  return one;
}

/// Returns the option `one`, marked as one that describes the position word; a word format that the user gives replaces
/// it.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> describing_word(OptionOf<member> one) {
  one.info.describes_word = true;
  return one;
}

/// Returns the option `one` as a decimal number, with values in units of 10^-`decimals`.
template <unsigned decimals, auto member>
[[nodiscard]] constexpr OptionOf<member> decimal(OptionOf<member> one) {
  one.info.decimals = decimals;
  return one;
}

/// Returns the option `one`, marked so that 0 is permitted too.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> or_zero(OptionOf<member> one) {
  one.info.or_zero = true;
  return one;
}

/// Returns the option `one` with the role `role`.
template <Role role, auto member>
[[nodiscard]] constexpr OptionOf<member> with_role(OptionOf<member> one) {
  one.info.role = role;
  return one;
}

/// Returns the option `one`, marked so that texts show its value in hexadecimal.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> in_hex(OptionOf<member> one) {
  one.info.in_hex = true;
  return one;
}

/// Table of a unit's options, with their members of the format.
template <auto... members>
struct OptionsOf {
  /// Format of the encoder: the values of its options.
  using Format = typename detail::MostDerived<typename OptionOf<members>::Format...>::Type;

  /// Constructs the table from the options, in their order.
  constexpr explicit OptionsOf(const OptionOf<members>&... all) : infos{all.info...} {}

  /// Returns the format whose members have the option values `values`.
  [[nodiscard]] constexpr Format format(const Options& values) const {
    Format made{};
    std::size_t index = 0;
    (OptionOf<members>::put(made, values[index++]), ...);
    return made;
  }
  /// Sets the member of `format` that belongs to the option number `option`.
  static constexpr void put(Format& format, std::size_t option, std::int64_t value) {
    std::size_t index = 0;
    ((index++ == option ? OptionOf<members>::put(format, value) : void()), ...);
  }
  /// Returns the value in `format` of the option number `option`.
  [[nodiscard]] static constexpr std::int64_t get(const Format& format, std::size_t option) {
    std::size_t index = 0;
    std::int64_t value = 0;
    ((index++ == option ? void(value = OptionOf<members>::get(format)) : void()), ...);
    return value;
  }
  /// Returns the index of the option with this name; the number of options if no option has it.
  [[nodiscard]] constexpr std::size_t find(std::string_view name) const {
    std::size_t i = 0;
    while (i < infos.size() && infos[i].name != name) ++i;
    return i;
  }

  /// Descriptions of the options, in their order.
  std::array<Option, sizeof...(members)> infos;
};

/// A model of encoder, with its option values as text: "bits=12 turns=false".
struct ModelText {
  std::string_view name;      ///< Name of the model.
  std::string_view meaning;   ///< Description of the model, as a phrase.
  std::uint32_t maximum_rpm;  ///< fastest shaft for which a position is specified, in rpm; 0: none stated
  std::string_view values;    ///< Options that the model sets, as `name=value` separated by blanks.
};

}  // namespace absenc::author
