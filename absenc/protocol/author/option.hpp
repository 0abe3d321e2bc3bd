// SPDX-License-Identifier: Apache-2.0
// Declares an option by the member of the format that it sets. The unit's table, the format, and the values of models
// and vectors follow from it.
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
// Value of an option for a member; times are in nanoseconds.
template <class Value>
constexpr std::int64_t number_of(const Value& value) {
  if constexpr (requires { value.count(); }) {
    return value.count();
  } else {
    return static_cast<std::int64_t>(value);
  }
}
// The type that derives from all others.
template <class One, class... Others>
struct MostDerived {
  using Type = One;
};
template <class One, class Next, class... Others>
struct MostDerived<One, Next, Others...>
    : MostDerived<std::conditional_t<std::is_base_of_v<One, Next>, Next, One>, Others...> {};
}  // namespace detail

/// An option with the member of the format that it sets.
template <auto member>
struct OptionOf {
  /// Format of the encoder: the values of its options.
  using Format = decltype(detail::format_of(member));
  /// Type of the member.
  using Member = decltype(detail::member_of(member));
  Option info;  ///< Description of the option.

  /// Sets the member.
  static constexpr void put(Format& format, std::int64_t value) { format.*member = static_cast<Member>(value); }
  /// Returns the value of the member.
  [[nodiscard]] static constexpr std::int64_t get(const Format& format) {
    return static_cast<std::int64_t>(format.*member);
  }
};

/// Declares a number from `minimum` to `maximum` in steps; the member has the default.
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

/// Declares a choice; the choices of an enumeration are in its order.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> option(std::string_view name, std::string_view meaning,
                                                std::span<const std::string_view> choices) {
  const auto value = typename OptionOf<member>::Format{}.*member;
  return {{.name = name, .meaning = meaning, .default_value = static_cast<std::int64_t>(value), .choices = choices}};
}

/// Declares a choice of yes and no.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> option(std::string_view name, std::string_view meaning) {
  return option<member>(name, meaning, std::span<const std::string_view>(boolean_choices));
}

/// Returns the option, marked as one whose value captured frames can show.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> probeable(OptionOf<member> one) {
  one.info.probeable = true;
  return one;
}

/// Returns the option, marked as one that a word format replaces.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> describing_word(OptionOf<member> one) {
  one.info.describes_word = true;
  return one;
}

/// Returns the option with this many decimal digits: its values are in units of the last digit.
template <unsigned decimals, auto member>
[[nodiscard]] constexpr OptionOf<member> decimal(OptionOf<member> one) {
  one.info.decimals = decimals;
  return one;
}

/// Returns the option, which may also be 0, below its range.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> or_zero(OptionOf<member> one) {
  one.info.or_zero = true;
  return one;
}

/// Returns the option with this role, by which code that does not know the unit finds it.
template <Role role, auto member>
[[nodiscard]] constexpr OptionOf<member> with_role(OptionOf<member> one) {
  one.info.role = role;
  return one;
}

/// Returns the option, which texts show in hexadecimal; users may write it so or in decimal.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> in_hex(OptionOf<member> one) {
  one.info.in_hex = true;
  return one;
}

/// Options of a unit: members of one struct and of its bases.
template <auto... members>
struct OptionsOf {
  /// Format of the encoder: the values of its options.
  using Format = typename detail::MostDerived<typename OptionOf<members>::Format...>::Type;

  /// Takes the options in their order.
  constexpr explicit OptionsOf(const OptionOf<members>&... all) : infos{all.info...} {}

  /// Returns the format with these values.
  [[nodiscard]] constexpr Format format(const Options& values) const {
    Format made{};
    std::size_t index = 0;
    (OptionOf<members>::put(made, values[index++]), ...);
    return made;
  }
  /// Sets the option of this index in `format`.
  static constexpr void put(Format& format, std::size_t option, std::int64_t value) {
    std::size_t index = 0;
    ((index++ == option ? OptionOf<members>::put(format, value) : void()), ...);
  }
  /// Returns the value of an option, by its index.
  [[nodiscard]] static constexpr std::int64_t get(const Format& format, std::size_t option) {
    std::size_t index = 0;
    std::int64_t value = 0;
    ((index++ == option ? void(value = OptionOf<members>::get(format)) : void()), ...);
    return value;
  }
  /// Returns the index of the option with this name; the number of options if there is none.
  [[nodiscard]] constexpr std::size_t find(std::string_view name) const {
    std::size_t i = 0;
    while (i < infos.size() && infos[i].name != name) ++i;
    return i;
  }

  /// Descriptions of the options.
  std::array<Option, sizeof...(members)> infos;
};

/// A model, whose values are text: "bits=12 turns=false".
struct ModelText {
  std::string_view name;      ///< Name of the model.
  std::string_view meaning;   ///< The model, as a phrase.
  std::uint32_t maximum_rpm;  ///< highest speed in rpm; 0: the document states none
  std::string_view values;    ///< Options that it sets, as `name=value` separated by blanks.
};

}  // namespace absenc::author
