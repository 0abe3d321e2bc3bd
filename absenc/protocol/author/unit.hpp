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
///   static constexpr Request guess_request(const Format&, Bytes reply);     // what was asked, of a reply alone; or a
///                                                  // Result
///
/// And may have:
///
///   static constexpr Error answer_to_bad(Error, Bytes reply);   // of a request that is none, and what came after it
///   static constexpr Explanation explain(...);     // command.hpp
///   static constexpr const FieldInfo *status, *alarms;
///   static constexpr ... memory, conditions, timing, covered;   // as in Unit
template <class Definition>
struct UnitOf {
  using P = typename Definition::Protocol;
  using Format = typename P::Format;
  using Request = typename P::Request;

  static constexpr Format format(const Options& values) { return Definition::options.format(values); }

  // ---- The functions of the descriptor

  static constexpr Error decode(const Options& values, Frame asked, Frame frame, FieldSink& sink) {
    const Format f = format(values);
    const Result<Request> request = request_of(f, asked.bytes, frame.bytes);
    if (!request) return request.error();
    if (frame.bytes.empty()) {
      Definition::put(sink, f, *request);
      return Error::none;
    }
    const auto reply = P::decode(f, *request, frame.bytes);
    if (!reply) return reply.error();
    Definition::put(sink, f, *request, *reply);
    const Reading reading = P::reading(f, *request, *reply);
    if (reading.singleturn_bits != 0 || reading.multiturn_bits != 0) sink.put_reading(reading);
    return Error::none;
  }

  static constexpr Result<Request> request_of(const Format& f, Bytes asked, Bytes reply) {
    if (asked.empty()) {
      if (reply.empty()) return Error::wrong_length;
      return Definition::guess_request(f, reply);
    }
    const Result<Request> request = P::decode_request(f, asked);
    if constexpr (requires { Definition::answer_to_bad(request.error(), reply); }) {
      if (!request) return Definition::answer_to_bad(request.error(), reply);
    }
    return request;
  }

  static constexpr const CommandOf<P>& find(const Command& command) { return Definition::commands[command.id]; }

  static Result<std::size_t> encode(const Options& values, const Command& command, Arguments arguments,
                                    MutableBytes out) {
    const Format f = format(values);
    const CommandOf<P>& one = find(command);
    if (one.missing != nullptr && !one.missing(f).empty()) return Error::unsupported;
    const auto bytes = P::encode(f, one.request(f, arguments));
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
    return make_device<typename Definition::Encoder>(storage, format(values), shaft);
  }

  static constexpr Resolution resolution(const Options& values) { return Definition::resolution(format(values)); }
  static constexpr LineSettings settings(const Options& values) { return Definition::line(format(values)); }

  static bool answered(const Options& values, Frame asked) {
    const Format f = format(values);
    const Result<Request> request = P::decode_request(f, asked.bytes);
    return !request || P::reply_size(f, *request) != 0;
  }

  static Explanation explain(const Options& values, Error error, Frame asked, Frame reply) {
    return Definition::explain(format(values), error, asked.bytes, reply.bytes);
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
    std::size_t most = sizeof(Refusal<std::uint8_t>);
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
      made[i] = {text.name, text.meaning, text.maximum_rpm, model_values[i].view()};
    }
    return made;
  }();

  // What the vectors point to, in no more room than it takes.
  struct VectorRoom {
    std::size_t bytes = 0;
    std::size_t fields = 0;
  };
  static constexpr VectorRoom room = [] {
    VectorRoom sum;
    for (const VectorText& text : Definition::vectors) {
      const VectorParts parts(text);
      sum.bytes += parts.request.size() + parts.reply.size();
      sum.fields += parts.fields.size();
    }
    return sum;
  }();
  struct VectorPool {
    std::array<std::uint8_t, room.bytes> bytes{};
    std::array<Expected, room.fields> fields{};
  };
  static constexpr VectorPool pool = [] {
    VectorPool made;
    auto bytes = made.bytes.begin();
    auto fields = made.fields.begin();
    for (const VectorText& text : Definition::vectors) {
      const VectorParts parts(text);
      bytes = std::copy(parts.request.view().begin(), parts.request.view().end(), bytes);
      bytes = std::copy(parts.reply.view().begin(), parts.reply.view().end(), bytes);
      fields = std::copy(parts.fields.view().begin(), parts.fields.view().end(), fields);
    }
    return made;
  }();
  static constexpr auto vectors = [] {
    std::array<Vector, Definition::vectors.size()> made{};
    Bytes bytes = pool.bytes;
    std::span<const Expected> fields = pool.fields;
    const auto take = [](auto& from, std::size_t size) {
      const auto taken = from.first(size);
      from = from.subspan(size);
      return taken;
    };
    for (std::size_t i = 0; i < made.size(); ++i) {
      const VectorText& text = Definition::vectors[i];
      const VectorParts parts(text);
      const Bytes request = take(bytes, parts.request.size());
      const Bytes reply = take(bytes, parts.reply.size());
      made[i] = {text.id,    text.meaning, text.source, text.options, request, reply, take(fields, parts.fields.size()),
                 parts.error};
    }
    return made;
  }();

  // Whether the text is understood, which comes over a model, which comes over the defaults.
  static constexpr bool resolve(std::string_view text, std::span<const OptionValue> model, Options& values) {
    for (std::size_t i = 0; i < Definition::options.infos.size(); ++i) {
      values.values[i] = Definition::options.infos[i].default_value;
    }
    for (const OptionValue& one : model) values.values[one.option] = one.value;
    return for_each_value(text, [&](std::string_view name, std::string_view value) {
      const std::size_t option = Definition::options.find(name);
      return option < Definition::options.infos.size() &&
             to_value(Definition::options.infos[option], value, values.values[option]);
    });
  }
  static constexpr bool agrees(const Model& model, const Options& values) {
    return std::all_of(model.values.begin(), model.values.end(),
                       [&](const OptionValue& one) { return values.values[one.option] == one.value; });
  }

  static constexpr bool holds(const Vector& vector) {
    Options values;
    bool known = resolve(vector.options, {}, values);
    // The first model that agrees with what is said, as resolve_options has it.
    for (const Model& model : models) {
      Options of_model;
      known = known && resolve(vector.options, model.values, of_model);
      if (!agrees(model, of_model)) continue;
      values = of_model;
      break;
    }
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
    unit.answered = answered;
    if constexpr (requires { Definition::status; }) unit.status = Definition::status;
    if constexpr (requires { Definition::alarms; }) unit.alarms = Definition::alarms;
    if constexpr (requires { Definition::memory; }) unit.memory = Definition::memory;
    if constexpr (requires { Definition::conditions; }) unit.conditions = Definition::conditions;
    if constexpr (requires { Definition::timing; }) unit.timing = Definition::timing;
    if constexpr (requires { Definition::covered; }) unit.covered = Definition::covered;
    if constexpr (requires { Definition::explain(Format{}, Error::none, Bytes{}, Bytes{}); }) unit.explain = explain;
    return unit;
  }
};

}  // namespace absenc::author
