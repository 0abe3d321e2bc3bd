// SPDX-License-Identifier: Apache-2.0
// Makes the descriptor of a unit from what its author declares. docs/protocol-template shows a whole one.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/author/command.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/author/line.hpp"
#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/author/text.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/protocol/vector_check.hpp"

namespace absenc::author {

/// `Definition` has:
///
///   using Protocol;                                // line.hpp, device.hpp
///   using Encoder;                                 // the virtual one: BusDevice, made of (format, shaft)
///   static constexpr std::string_view id, name, document;
///   static constexpr LinkKind link;
///   static constexpr LineSettings line(const Format&);
///   static constexpr OptionsOf options;            // option.hpp; their defaults are those of Format
///   static constexpr std::array models;            // of ModelText
///   static constexpr FieldsOf fields;              // field.hpp
///   static constexpr std::array commands;          // of CommandOf, command.hpp
///   static constexpr std::array vectors;           // of VectorText, text.hpp: they hold, or it does not compile
///   static constexpr std::size_t frames_size;      // bytes of storage that the procedures' frames need at the most
///   static constexpr Resolution resolution(const Format&);
///   static constexpr void put(FieldSink&, const Format&, const Request&);
///   static constexpr void put(FieldSink&, const Format&, const Request&, const Reply&);
///   static constexpr std::size_t reply_size(const Format&, Bytes begin);    // of any reply that begins so; 0: none
///   static constexpr Request guess_request(const Format&, Bytes reply);     // what was asked, of a reply alone
///   static constexpr Explanation explain(...);     // command.hpp; may be left out
///   static constexpr const FieldInfo *status, *alarms;   // may be left out, as `conditions`, `timing` and `covered`
///   static constexpr Format format(const Options&);      // where members of it alone do not say what options mean
///   static constexpr bool is_usable(const Format&);      // false: no virtual encoder is made; left out: it always is
///   static constexpr bool frames_are_texts = true;       // those of vectors; left out: they are hexadecimal
template <class Definition>
struct UnitOf {
  using P = typename Definition::Protocol;
  using Format = typename P::Format;
  using Request = typename P::Request;

  static constexpr Format format(const Options& values) {
    if constexpr (requires { Definition::format(values); }) {
      return Definition::format(values);
    } else {
      return Definition::options.format(values);
    }
  }

  // ---- The functions of the descriptor

  static constexpr Error decode(const Options& values, Frame asked, Frame frame, FieldSink& sink) {
    const Format f = format(values);
    Request request = Definition::guess_request(f, frame.bytes);
    if (!asked.bytes.empty()) {
      const Result<Request> result = P::decode_request(f, asked.bytes);
      if (!result) return result.error();
      request = *result;
    } else if (frame.bytes.empty()) {
      return Error::wrong_length;
    }
    if (frame.bytes.empty()) {
      Definition::put(sink, f, request);
      return Error::none;
    }
    const auto reply = P::decode(f, request, frame.bytes);
    if (!reply) return reply.error();
    Definition::put(sink, f, request, *reply);
    const Reading reading = P::reading(f, request, *reply);
    if (reading.singleturn_bits != 0 || reading.multiturn_bits != 0) sink.put_reading(reading);
    return Error::none;
  }

  static constexpr const CommandOf<P>& find(const Command& command) { return command_table[command.id]; }

  static Result<std::size_t> encode(const Options& values, const Command& command, Arguments arguments,
                                    MutableBytes out) {
    const Format f = format(values);
    const CommandOf<P>& one = find(command);
    if (one.missing != nullptr && !one.missing(f).empty()) return Error::unsupported;
    const auto bytes = P::encode(f, one.request(f, arguments));
    if (bytes.empty()) return Error::invalid_argument;
    if (bytes.size() > out.size()) return Error::buffer_too_small;
    std::copy_n(bytes.view().begin(), bytes.size(), out.begin());
    return bytes.size();
  }

  static constexpr Delimit delimit(const Options& values, Direction direction, Bytes bytes) {
    if (bytes.empty()) return {Delimit::Kind::incomplete, 1};
    const std::size_t size =
        direction == Direction::request ? P::request_size(bytes) : Definition::reply_size(format(values), bytes);
    if (size == 0) return {Delimit::Kind::no_frame};
    return {bytes.size() < size ? Delimit::Kind::incomplete : Delimit::Kind::complete, size};
  }

  static Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                                std::span<std::byte> storage) {
    return find(command).run(format(values), arguments, storage);
  }

  static Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
    const Format f = format(values);
    if constexpr (requires { Definition::is_usable(f); }) {
      if (!Definition::is_usable(f)) return {};
    }
    return make_device<typename Definition::Encoder>(storage, f, shaft);
  }

  static constexpr Resolution resolution(const Options& values) { return Definition::resolution(format(values)); }
  static constexpr LineSettings settings(const Options& values) { return Definition::line(format(values)); }

  static bool answered(const Options& values, Frame asked) {
    const Format f = format(values);
    const Result<Request> request = P::decode_request(f, asked.bytes);
    if (!request) return true;
    const Manner manner = P::manner(f, *request);
    return manner.answered && !manner.any_reply;
  }

  static Explanation explain(const Options& values, Error error, Frame asked, Frame reply) {
    return Definition::explain(format(values), error, asked.bytes, reply.bytes);
  }

  // ---- Its tables

  // Copies, because g++ lets those of a class that is no template be written to: on firmware that is RAM.
  static constexpr auto command_table = Definition::commands;
  static constexpr auto options = Definition::options.infos;

  static constexpr auto commands = [] {
    std::array<Command, Definition::commands.size()> made{};
    for (std::size_t i = 0; i < made.size(); ++i) {
      made[i] = Definition::commands[i].info;
      made[i].id = static_cast<std::uint8_t>(i);
    }
    return made;
  }();

  static constexpr std::size_t host_storage = [] {
    std::size_t most = sizeof(Refusal<std::uint8_t>);
    for (const CommandOf<P>& one : Definition::commands) most = std::max(most, one.size);
    return most + Definition::frames_size;
  }();

  // What texts say lies one behind the other, and no larger than if it were written by hand.
  static constexpr Buffer<OptionValue, maximum_options> values_of(const ModelText& model) {
    Buffer<OptionValue, maximum_options> made;
    const bool good = for_each_value(model.values, [&](std::string_view name, std::string_view text) {
      const std::size_t option = Definition::options.find(name);
      std::int64_t value = 0;
      return option < Definition::options.infos.size() && to_value(Definition::options.infos[option], text, value) &&
             made.push_back({option, value});
    });
    if (!good) this_model_has_an_option_or_a_value_that_the_unit_does_not_have();
    return made;
  }
  static constexpr auto model_values = [] {
    constexpr std::size_t size = [] {
      std::size_t sum = 0;
      for (const ModelText& text : Definition::models) sum += values_of(text).size();
      return sum;
    }();
    Buffer<OptionValue, size> all;
    for (const ModelText& text : Definition::models) all.append(values_of(text));
    return all;
  }();
  static constexpr auto models = [] {
    std::array<Model, Definition::models.size()> made{};
    std::size_t first = 0;
    for (std::size_t i = 0; i < made.size(); ++i) {
      const ModelText& text = Definition::models[i];
      const std::size_t size = values_of(text).size();
      made[i] = {text.name, text.meaning, text.maximum_rpm, model_values.view().subspan(first, size)};
      first += size;
    }
    return made;
  }();

  static constexpr VectorParts parts_of(const VectorText& text) {
    return VectorParts(
        text, requires { Definition::frames_are_texts; });
  }
  static constexpr auto vector_parts = [] {
    constexpr auto sizes = [] {
      std::array<std::size_t, 2> sums{};
      for (const VectorText& text : Definition::vectors) {
        const VectorParts parts = parts_of(text);
        sums[0] += parts.request.size() + parts.reply.size();
        sums[1] += parts.fields.size();
      }
      return sums;
    }();
    AllParts<sizes[0], sizes[1]> all;
    for (const VectorText& text : Definition::vectors) {
      const VectorParts parts = parts_of(text);
      all.bytes.append(parts.request);
      all.bytes.append(parts.reply);
      all.fields.append(parts.fields);
    }
    return all;
  }();
  static constexpr auto vectors = [] {
    std::array<Vector, Definition::vectors.size()> made{};
    Bytes bytes = vector_parts.bytes;
    std::span<const Expected> fields = vector_parts.fields;
    const auto taken = [](auto& all, std::size_t size) {
      const auto first = all.first(size);
      all = all.subspan(size);
      return first;
    };
    for (std::size_t i = 0; i < made.size(); ++i) {
      const VectorText& text = Definition::vectors[i];
      const VectorParts parts = parts_of(text);
      const Bytes request = taken(bytes, parts.request.size());
      const Bytes reply = taken(bytes, parts.reply.size());
      made[i] = {
          text.id,    text.meaning, text.source, text.options, request, reply, taken(fields, parts.fields.size()),
          parts.error};
    }
    return made;
  }();

  static constexpr bool holds(const Vector& vector) {
    Options values;
    for (std::size_t i = 0; i < Definition::options.infos.size(); ++i) {
      values.values[i] = Definition::options.infos[i].default_value;
    }
    const bool known = for_each_value(vector.options, [&](std::string_view name, std::string_view text) {
      const std::size_t option = Definition::options.find(name);
      return option < Definition::options.infos.size() &&
             to_value(Definition::options.infos[option], text, values.values[option]);
    });
    VectorCheck check(vector.fields);
    return known && decode(values, {.bytes = vector.request}, {.bytes = vector.reply}, check) == vector.error &&
           check.all();
  }
  static_assert(std::all_of(vectors.begin(), vectors.end(), holds), "a vector does not decode to what it says");

  static constexpr Unit make() {
    Unit unit{.id = Definition::id,
              .name = Definition::name,
              .document = Definition::document,
              .link = Definition::link,
              .line = Definition::line(Format{}),
              .options = options,
              .models = models,
              .fields = Definition::fields.infos,
              .commands = commands,
              .vectors = vectors,
              .status = nullptr,
              .alarms = nullptr,
              .host_storage = host_storage,
              .device_storage = sizeof(typename Definition::Encoder),
              .decode = decode,
              .encode = encode,
              .delimit = delimit,
              .host = host,
              .device = device,
              .resolution = resolution,
              .settings = settings};
    unit.answered = answered;
    if constexpr (requires { Definition::status; }) unit.status = Definition::status;
    if constexpr (requires { Definition::alarms; }) unit.alarms = Definition::alarms;
    if constexpr (requires { Definition::conditions; }) unit.conditions = Definition::conditions;
    if constexpr (requires { Definition::timing; }) unit.timing = Definition::timing;
    if constexpr (requires { Definition::covered; }) unit.covered = Definition::covered;
    if constexpr (requires { Definition::explain(Format{}, Error::none, Bytes{}, Bytes{}); }) unit.explain = explain;
    return unit;
  }
};

}  // namespace absenc::author
