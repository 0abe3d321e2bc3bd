// SPDX-License-Identifier: Apache-2.0
// Declares a field by the member of a struct that has its value, or by a function that computes it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "absenc/protocol/field.hpp"

namespace absenc::author {

/// Description of a field whose value is a member of a struct, or the result of a function.
template <auto member>
struct FieldOf {
  FieldInfo info;  ///< Description of the field.
};

/// Value of a text field: ASCII characters as bytes, which must outlive the call of `put`.
struct AsciiText {
  Bytes bytes;  ///< The characters of the text.
};

namespace detail {
template <class Values, class T>
T shown_by(T Values::*);
template <class Values, class T>
T shown_by(T (*)(const Values&));
template <class T>
T held_by(const T&);
template <class T>
T held_by(const std::optional<T>&);

template <auto member>
using Held = decltype(held_by(shown_by(member)));

/// Returns the kind of field for a value of the type `T`.
template <class T>
constexpr FieldInfo::Kind kind_of() {
  if (std::is_same_v<T, bool>) return FieldInfo::Kind::boolean;
  if (std::is_same_v<T, double>) return FieldInfo::Kind::real;
  if (std::is_same_v<T, std::string_view> || std::is_same_v<T, AsciiText>) return FieldInfo::Kind::text;
  if (std::is_same_v<T, Bytes>) return FieldInfo::Kind::bytes;
  if (std::is_same_v<T, std::uint64_t>) return FieldInfo::Kind::counts;
  return FieldInfo::Kind::number;
}
}  // namespace detail

/// Returns the declaration of a field with the value of `member`. A value that is an empty optional is not put.
template <auto member>
[[nodiscard]] constexpr FieldOf<member> field(std::string_view name, std::string_view unit, std::string_view meaning,
                                              Role role = Role::other) {
  return {
      {.name = name, .kind = detail::kind_of<detail::Held<member>>(), .unit = unit, .meaning = meaning, .role = role}};
}
/// Returns the declaration of a field of flags whose value is `member`.
template <auto member>
[[nodiscard]] constexpr FieldOf<member> field(std::string_view name, std::string_view meaning,
                                              std::span<const FlagInfo> flags) {
  return {{name, FieldInfo::Kind::flags, {}, meaning, flags}};
}

/// Returns the field `one`, marked so that texts show its value in hexadecimal.
template <auto member>
[[nodiscard]] constexpr FieldOf<member> in_hex(FieldOf<member> one) {
  one.info.in_hex = true;
  return one;
}

/// Table of the fields of a struct `Values`.
template <class Values, auto... members>
struct FieldsOf {
  /// Constructs the table from the fields, in the order in which they are put.
  constexpr explicit FieldsOf(const FieldOf<members>&... all) : infos{all.info...} {}

  /// Puts the fields of `values` into `sink`, in the order of the table, except empty optionals.
  constexpr void put(FieldSink& sink, const Values& values) const {
    std::size_t index = 0;
    (put_one(sink, infos[index++], shown<members>(values)), ...);
  }

  /// Puts the field of `member` with this value into `sink`.
  template <auto member>
  constexpr void put(FieldSink& sink, const detail::Held<member>& value) const {
    put_one(sink, *of<member>(), value);
  }

  /// Returns the description of the field of `member`.
  template <auto member>
  [[nodiscard]] constexpr const FieldInfo* of() const {
    std::size_t index = 0;
    static_cast<void>(((std::is_same_v<FieldOf<member>, FieldOf<members>> || (++index, false)) || ...));
    return &infos[index];
  }

  /// Descriptions of the fields, in the order of the table.
  std::array<FieldInfo, sizeof...(members)> infos;

 private:
  template <auto member>
  static constexpr auto shown(const Values& values) {
    if constexpr (std::is_member_pointer_v<decltype(member)>) {
      return values.*member;
    } else {
      return member(values);
    }
  }
  template <class T>
  static constexpr void put_one(FieldSink& sink, const FieldInfo& info, const T& value) {
    if constexpr (std::is_same_v<T, double>) {
      sink.put({.info = &info, .real = value});
    } else if constexpr (std::is_same_v<T, Bytes>) {
      sink.put({.info = &info, .bytes = value});
    } else if constexpr (std::is_same_v<T, AsciiText>) {
      sink.put({.info = &info, .bytes = value.bytes});
    } else if constexpr (std::is_same_v<T, std::string_view>) {
      ByteBuffer<96> text;
      for (const char c : value) text.push_back(static_cast<std::uint8_t>(c));
      sink.put({.info = &info, .bytes = text});
    } else {
      sink.put({.info = &info, .number = static_cast<std::int64_t>(value)});
    }
  }
  template <class T>
  static constexpr void put_one(FieldSink& sink, const FieldInfo& info, const std::optional<T>& value) {
    if (value) put_one(sink, info, *value);
  }
};

/// Returns a table of the fields `all`.
template <class Values, auto... members>
[[nodiscard]] constexpr FieldsOf<Values, members...> fields_of(const FieldOf<members>&... all) {
  return FieldsOf<Values, members...>(all...);
}

/// Returns an array with the fields of all given arrays, for Declaration::fields.
template <std::size_t... sizes>
[[nodiscard]] constexpr auto joined(const std::array<FieldInfo, sizes>&... infos) {
  std::array<FieldInfo, (sizes + ...)> all{};
  FieldInfo* next = all.data();
  ((next = std::copy(infos.begin(), infos.end(), next)), ...);
  return all;
}

}  // namespace absenc::author
