// SPDX-License-Identifier: Apache-2.0
// Makes the tables of a unit's descriptor from its Declaration, at compile time.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/author/command.hpp"
#include "absenc/protocol/author/declaration.hpp"
#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/author/text.hpp"

namespace absenc::author {

/// Tables of commands, models and vectors of the Declaration `declared`.
template <const auto& declared>
struct Tables {
  /// Class with the functions of the protocol.
  using P = typename std::remove_cvref_t<decltype(declared)>::Protocol;

  /// Descriptions of the commands, numbered in their order.
  static constexpr auto commands = [] {
    std::array<Command, declared.commands.size()> made{};
    for (std::size_t i = 0; i < made.size(); ++i) {
      made[i] = declared.commands[i].info;
      made[i].id = static_cast<std::uint8_t>(i);
    }
    return made;
  }();

  /// Bytes of storage that are enough for each conversation, with the frames of its coroutines.
  static constexpr std::size_t host_storage = [] {
    std::size_t most = sizeof(Refusal<ItemOf<P>>);
    for (const CommandOf<P>& one : declared.commands) most = std::max(most, one.size);
    return most + declared.frames_size;
  }();

  /// Returns the index of the option with this name; the number of options if no option has it.
  static constexpr std::size_t find_option(std::string_view name) {
    std::size_t i = 0;
    while (i < declared.options.size() && declared.options[i].name != name) ++i;
    return i;
  }

  /// Returns the option values of a model; a text that cannot be parsed does not compile.
  static constexpr Buffer<OptionValue, maximum_options> values_of(const ModelText& model) {
    Buffer<OptionValue, maximum_options> made;
    const bool good = for_each_value(model.values, [&](std::string_view name, std::string_view text) {
      const std::size_t option = find_option(name);
      if (option == declared.options.size()) return false;
      const Result<std::int64_t> value = parse_value(declared.options[option], text);
      return value && made.push_back({option, *value});
    });
    if (!good) this_model_has_an_option_or_a_value_that_the_unit_does_not_have();
    return made;
  }
  /// Option values of all models, one after the other.
  static constexpr auto model_values = [] {
    constexpr std::size_t size = [] {
      std::size_t sum = 0;
      for (const ModelText& text : declared.models) sum += values_of(text).size();
      return sum;
    }();
    Buffer<OptionValue, size> all;
    for (const ModelText& text : declared.models) all.append(values_of(text));
    return all;
  }();
  /// Descriptions of the models, whose values point into `model_values`.
  static constexpr auto models = [] {
    std::array<Model, declared.models.size()> made{};
    std::size_t first = 0;
    for (std::size_t i = 0; i < made.size(); ++i) {
      const ModelText& text = declared.models[i];
      const std::size_t size = values_of(text).size();
      made[i] = {text.name, text.meaning, text.maximum_rpm, {}};
      // G++ 12 cannot make a view of an empty buffer at compile time.
      if (size != 0) made[i].values = model_values.view().subspan(first, size);
      first += size;
    }
    return made;
  }();

  /// Returns the parsed content of a vector's text.
  static constexpr VectorParts parts_of(const VectorText& text) {
    return VectorParts(text, Clocked<P> || Bitwise<P> || declared.frames_are_texts);
  }
  /// Bytes and expected fields of all vectors, one after the other.
  static constexpr auto vector_parts = [] {
    constexpr auto sizes = [] {
      std::array<std::size_t, 2> sums{};
      for (const VectorText& text : declared.vectors) {
        const VectorParts parts = parts_of(text);
        sums[0] += parts.request.size() + parts.reply.size();
        sums[1] += parts.fields.size();
      }
      return sums;
    }();
    AllParts<sizes[0], sizes[1]> all;
    for (const VectorText& text : declared.vectors) {
      const VectorParts parts = parts_of(text);
      all.bytes.append(parts.request);
      all.bytes.append(parts.reply);
      all.fields.append(parts.fields);
    }
    return all;
  }();
  /// The test vectors, whose frames and expected fields point into `vector_parts`.
  static constexpr auto vectors = [] {
    std::array<Vector, declared.vectors.size()> made{};
    Bytes bytes = vector_parts.bytes;
    std::span<const Expected> fields = vector_parts.fields;
    const auto taken = [](auto& all, std::size_t size) {
      const auto first = all.first(size);
      all = all.subspan(size);
      return first;
    };
    for (std::size_t i = 0; i < made.size(); ++i) {
      const VectorText& text = declared.vectors[i];
      const VectorParts parts = parts_of(text);
      const Bytes request = taken(bytes, parts.request.size());
      const Bytes reply = taken(bytes, parts.reply.size());
      made[i] = {text.id,
                 text.meaning,
                 text.source,
                 text.options,
                 request,
                 reply,
                 taken(fields, parts.fields.size()),
                 parts.error,
                 parts.open_request,
                 parts.open_reply};
    }
    return made;
  }();
};

}  // namespace absenc::author
