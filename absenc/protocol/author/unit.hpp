// SPDX-License-Identifier: Apache-2.0
// Makes the descriptor of a unit from what its author declares. docs/protocol-template shows a whole one.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <type_traits>

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
///   static constexpr std::array vectors;           // of VectorText (text.hpp), or of Vector: they hold, or it does
///   not
///                                                  // compile
///   static constexpr std::size_t frames_size;      // bytes of storage that the procedures' frames need at the most
///   static constexpr Resolution resolution(const Format&);
///   static constexpr void put(FieldSink&, const Format&, const Request&);
///   static constexpr void put(FieldSink&, const Format&, const Request&, const Reply&);
///   static constexpr std::size_t reply_size(const Format&, Bytes begin);    // of any reply that begins so; 0: none
///   static constexpr Request guess_request(const Format&, Bytes reply);     // what was asked, of a reply alone
///   static constexpr Explanation explain(...);     // command.hpp; may be left out
///   static constexpr const FieldInfo *status, *alarms;   // may be left out, as `conditions`, `timing`, `covered`,
///                                                        // `probe`, `streams` and `extra_lines`
///
/// Where these do not say it, `decode`, `delimit` and `answered` themselves, with the parameters that they have in
/// Unit.
template <class Definition>
struct UnitOf {
  using P = typename Definition::Protocol;
  using Format = typename P::Format;
  using Request = typename P::Request;

  static constexpr Format format(const Options& values) { return Definition::options.format(values); }

  // ---- The functions of the descriptor

  static constexpr Error decode(const Options& values, Frame asked, Frame frame, FieldSink& sink) {
    if constexpr (requires { Definition::decode(values, asked, frame, sink); }) {
      return Definition::decode(values, asked, frame, sink);
    } else {
      return decode_bytes(values, asked, frame, sink);
    }
  }

  static constexpr Error decode_bytes(const Options& values, Frame asked, Frame frame, FieldSink& sink) {
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

  static constexpr const CommandOf<P>& find(const Command& command) { return Definition::commands[command.id]; }

  static Result<std::size_t> encode(const Options& values, const Command& command, Arguments arguments,
                                    MutableBytes out) {
    const Format f = format(values);
    const CommandOf<P>& one = find(command);
    if (one.missing != nullptr && !one.missing(f).empty()) return Error::unsupported;
    const Result<Request> request = one.request(f, arguments);
    if (!request) return request.error();
    const auto bytes = P::encode(f, *request);
    if (bytes.empty()) return Error::unsupported;  // a pulse asks
    if (bytes.size() > out.size()) return Error::buffer_too_small;
    std::copy_n(bytes.view().begin(), bytes.size(), out.begin());
    return bytes.size();
  }

  static constexpr Delimit delimit(const Options& values, Direction direction, Bytes bytes) {
    if constexpr (requires { Definition::delimit(values, direction, bytes); }) {
      return Definition::delimit(values, direction, bytes);
    } else {
      if (bytes.empty()) return {Delimit::Kind::incomplete, 1};
      const std::size_t size =
          direction == Direction::request ? P::request_size(bytes) : Definition::reply_size(format(values), bytes);
      if (size == 0) return {Delimit::Kind::no_frame};
      return {bytes.size() < size ? Delimit::Kind::incomplete : Delimit::Kind::complete, size};
    }
  }

  static Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                                std::span<std::byte> storage) {
    return find(command).run(format(values), arguments, storage);
  }

  static Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
    return make_device<typename Definition::Encoder>(storage, format(values), shaft);
  }

  static constexpr Resolution resolution(const Options& values) { return Definition::resolution(format(values)); }
  static constexpr LineSettings settings(const Options& values) { return Definition::line(format(values)); }

  static bool answered(const Options& values, Frame asked) {
    if constexpr (requires { Definition::answered(values, asked); }) {
      return Definition::answered(values, asked);
    } else {
      const Format f = format(values);
      const Result<Request> request = P::decode_request(f, asked.bytes);
      return !request || P::reply_size(f, *request) != 0;
    }
  }

  // As the links of the protocol carry it.
  static constexpr std::span<const ItemOf<P>> items(const Frame& frame) {
    if constexpr (std::is_same_v<ItemOf<P>, CanFrame>) {
      return {frame.can, frame.can != nullptr ? 1u : 0u};
    } else {
      return frame.bytes;
    }
  }

  static Explanation explain(const Options& values, Error error, Frame asked, Frame reply) {
    return Definition::explain(format(values), error, items(asked), items(reply));
  }

  // ---- Its tables

  static constexpr auto commands = [] {
    std::array<Command, Definition::commands.size()> made{};
    for (std::size_t i = 0; i < made.size(); ++i) {
      made[i] = Definition::commands[i].info;
      made[i].id = static_cast<std::uint8_t>(i);
    }
    return made;
  }();

  static constexpr std::size_t host_storage = [] {
    std::size_t most = sizeof(Refusal<ItemOf<P>>);
    for (const CommandOf<P>& one : Definition::commands) most = std::max(most, one.size);
    return most + Definition::frames_size;
  }();

  static constexpr auto model_values = [] {
    std::array<Buffer<OptionValue, maximum_options>, Definition::models.size()> made{};
    for (std::size_t i = 0; i < made.size(); ++i) {
      const bool good = for_each_value(Definition::models[i].values, [&](std::string_view name, std::string_view text) {
        const std::size_t option = Definition::options.find(name);
        std::int64_t value = 0;
        return option < Definition::options.infos.size() && to_value(Definition::options.infos[option], text, value) &&
               made[i].push_back({option, value});
      });
      if (!good) this_model_has_an_option_or_a_value_that_the_unit_does_not_have();
    }
    return made;
  }();
  static constexpr auto models = [] {
    std::array<Model, Definition::models.size()> made{};
    for (std::size_t i = 0; i < made.size(); ++i) {
      const ModelText& text = Definition::models[i];
      made[i] = {text.name, text.meaning, text.maximum_rpm, {}};
      if (!text.values.empty()) made[i].values = model_values[i].view();  // g++ 12 cannot view an empty one
    }
    return made;
  }();

  static constexpr bool has_texts = std::is_same_v<typename decltype(Definition::vectors)::value_type, VectorText>;
  static constexpr auto vector_parts = [] {
    std::array<VectorParts, has_texts ? Definition::vectors.size() : 0> made{};
    if constexpr (has_texts) {
      for (std::size_t i = 0; i < made.size(); ++i) made[i] = VectorParts(Definition::vectors[i]);
    }
    return made;
  }();
  static constexpr auto vectors = [] {
    if constexpr (has_texts) {
      std::array<Vector, Definition::vectors.size()> made{};
      for (std::size_t i = 0; i < made.size(); ++i) {
        const VectorText& text = Definition::vectors[i];
        const VectorParts& parts = vector_parts[i];
        made[i] = {text.id,
                   text.meaning,
                   text.source,
                   text.options,
                   parts.request.view(),
                   parts.reply.view(),
                   parts.fields.view(),
                   parts.error};
      }
      return made;
    } else {
      return Definition::vectors;
    }
  }();

  static constexpr Error decode_vector(const Options& values, const Vector& vector, FieldSink& sink) {
    if constexpr (std::is_same_v<ItemOf<P>, CanFrame>) {
      const CanFrame request = can_frame_of_text(vector.request);
      const CanFrame reply = can_frame_of_text(vector.reply);
      return decode(values, {.can = vector.request.empty() ? nullptr : &request},
                    {.can = vector.reply.empty() ? nullptr : &reply}, sink);
    } else {
      return decode(values, {.bytes = vector.request}, {.bytes = vector.reply}, sink);
    }
  }

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
    return known && decode_vector(values, vector, check) == vector.error && check.all();
  }
  static_assert(std::all_of(vectors.begin(), vectors.end(), holds), "a vector does not decode to what it says");

  static constexpr Unit make() {
    Unit unit{.id = Definition::id,
              .name = Definition::name,
              .document = Definition::document,
              .link = Definition::link,
              .line = Definition::line(Format{}),
              .options = Definition::options.infos,
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
    if constexpr (
        requires { P::reply_size(Format{}, Request{}); } || requires { &Definition::answered; }) {
      unit.answered = answered;
    }
    if constexpr (requires { Definition::status; }) unit.status = Definition::status;
    if constexpr (requires { Definition::alarms; }) unit.alarms = Definition::alarms;
    if constexpr (requires { Definition::conditions; }) unit.conditions = Definition::conditions;
    if constexpr (requires { Definition::timing; }) unit.timing = Definition::timing;
    if constexpr (requires { Definition::covered; }) unit.covered = Definition::covered;
    if constexpr (requires { Definition::probe; }) unit.probe = Definition::probe;
    if constexpr (requires { Definition::streams; }) unit.streams = Definition::streams;
    if constexpr (requires { Definition::extra_lines; }) unit.extra_lines = Definition::extra_lines;
    if constexpr (requires { Definition::explain(Format{}, Error::none, items({}), items({})); }) {
      unit.explain = explain;
    }
    return unit;
  }
};

}  // namespace absenc::author
