// SPDX-License-Identifier: Apache-2.0
// An option is declared with the member of the format that it sets: the table of the unit, the format, and what models
// and vectors say of it follow.
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
// Of a time nanoseconds.
template <class Value>
constexpr std::int64_t number_of(const Value& value) {
  if constexpr (requires { value.count(); }) {
    return value.count();
  } else {
    return static_cast<std::int64_t>(value);
  }
}
// The one that derives from all others.
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

/// A number from `minimum` to `maximum` in steps; its default is that of the member.
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

/// One of `choices`: of an enumeration, in its order.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> option(std::string_view name, std::string_view meaning,
                                                std::span<const std::string_view> choices) {
  const auto value = typename OptionOf<member>::Format{}.*member;
  return {{.name = name, .meaning = meaning, .default_value = static_cast<std::int64_t>(value), .choices = choices}};
}

/// Yes or no.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> option(std::string_view name, std::string_view meaning) {
  return option<member>(name, meaning, std::span<const std::string_view>(boolean_choices));
}

/// The same option, which captured frames can tell.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> probeable(OptionOf<member> one) {
  one.info.probeable = true;
  return one;
}

/// The same option, which a word format says instead.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> describing_word(OptionOf<member> one) {
  one.info.describes_word = true;
  return one;
}

/// The same option, of which the user writes so many digits behind a point: its values are in units of the last one.
template <unsigned decimals, auto member>
[[nodiscard]] constexpr OptionOf<member> decimal(OptionOf<member> one) {
  one.info.decimals = decimals;
  return one;
}

/// The same option, which may also be 0, below its range.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> or_zero(OptionOf<member> one) {
  one.info.or_zero = true;
  return one;
}

/// The same option, which others than its unit know by this role.
template <Role role, auto member>
[[nodiscard]] constexpr OptionOf<member> with_role(OptionOf<member> one) {
  one.info.role = role;
  return one;
}

/// The same option, which texts show in hexadecimal; it may be written so or in decimal.
template <auto member>
[[nodiscard]] constexpr OptionOf<member> in_hex(OptionOf<member> one) {
  one.info.in_hex = true;
  return one;
}

/// Members of one struct, and of what it derives from.
template <auto... members>
struct OptionsOf {
  /// Format of the encoder: the values of its options.
  using Format = typename detail::MostDerived<typename OptionOf<members>::Format...>::Type;

  /// Takes the options in their order.
  constexpr explicit OptionsOf(const OptionOf<members>&... all) : infos{all.info...} {}

  /// What these values make of the format's own.
  [[nodiscard]] constexpr Format format(const Options& values) const {
    Format made{};
    std::size_t index = 0;
    (OptionOf<members>::put(made, values[index++]), ...);
    return made;
  }
  /// The option of this index alone.
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
  /// Index of the option with this name; the number of options when there is none.
  [[nodiscard]] constexpr std::size_t find(std::string_view name) const {
    std::size_t i = 0;
    while (i < infos.size() && infos[i].name != name) ++i;
    return i;
  }

  /// Descriptions of the options.
  std::array<Option, sizeof...(members)> infos;
};

/// A model as text: "bits=12 turns=false".
struct ModelText {
  std::string_view name;      ///< Name of the model.
  std::string_view meaning;   ///< What the model is, as a phrase.
  std::uint32_t maximum_rpm;  ///< 0: the document states none
  std::string_view values;    ///< Options that it sets, as `name=value` separated by blanks.
};

}  // namespace absenc::author
