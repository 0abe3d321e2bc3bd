// SPDX-License-Identifier: Apache-2.0
// Makes the descriptor of a unit from what its author declares. docs/protocol-template shows a whole one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>
#include <type_traits>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/author/command.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/author/tables.hpp"
#include "absenc/protocol/author/text.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/protocol/vector_check.hpp"

namespace absenc::author {

/// Shortens what a Definition that derives from it declares: `command<Found, procedure, request>({...})`.
template <class Definition, class P>
struct Declares {
  using Protocol = P;
  template <auto request>
  [[nodiscard]] static constexpr CommandOf<P> reading(const Command& info) {
    return author::reading<Definition, P, request>(info);
  }
  template <class Found, auto procedure, auto request, auto... bound>
  [[nodiscard]] static constexpr CommandOf<P> command(const Command& info) {
    return author::command<Definition, P, Found, procedure, request, bound...>(info);
  }
};

/// A Definition has these, all static and constexpr:
///
/// - `Protocol` (dialog.hpp, device.hpp; clocked_host.hpp), and `Encoder`, the virtual one, made of (format, shaft):
///   BusDevice, ClockedDevice
/// - `id`, `name`, `document`, `link`
/// - `options`: OptionsOf (option.hpp), whose defaults are those of Format; or `Format format(const Options&)`
/// - `models`: an array of ModelText
/// - `fields`: FieldsOf (field.hpp)
/// - `commands`: an array of CommandOf (command.hpp)
/// - `vectors`: an array of VectorText (text.hpp) or of Vector; they hold, or it does not compile. `frames_are_texts`:
///   those of the texts are no hexadecimal; clocked ones are texts of 0 and 1
/// - `frames_size`: bytes of storage that the procedures' frames need at the most
/// - `values(format, request)`, `values(format, request, reply)`, `values(format, found)`: see put_values (command.hpp)
/// - `Request guess_request(const Format&, Bytes reply)`: what was asked, of a reply alone; or a Result, where it
///   may not tell. On a clocked line, where nothing is asked, there is none
///
/// and where it must: `line(format)`, `resolution(format)` (else those of the format); `reply_size(format, begin)`, of
/// any reply that begins so, 0: none (else the longest); `explain(format, error, request, reply)`; `is_usable(format)`,
/// false: no virtual encoder is made, nor any clocked frame decoded; `answer_to_bad(error, reply)`, of a request that
/// is none; `status`, `alarms`, `conditions`, `timing`, `is_checked`, `bits`, `memory`, `registers`, `over_spi`,
/// `probe`, `streams`, `extra_wires`, `control_bit` as in Unit; and `decode`, `frame_end`, `is_answered` themselves,
/// with the parameters that they have there.
template <class Definition>
struct UnitOf {
  using P = typename Definition::Protocol;
  using Format = typename P::Format;
  using Request = typename P::Request;
  using Tables = TablesOf<Definition>;

  static constexpr Format format(const Options& values) {
    if constexpr (requires { Definition::format(values); }) {
      return Definition::format(values);
    } else {
      return Definition::options.format(values);
    }
  }

  // ---- The functions of the descriptor

  static constexpr Error decode(const Options& values, Frame asked, Frame frame, FieldSink& sink) {
    if constexpr (requires { Definition::decode(Format{}, asked, frame, sink); }) {
      return Definition::decode(format(values), asked, frame, sink);
    } else if constexpr (Clocked<P>) {
      return decode_bits(format(values), to_bits(frame), sink);
    } else {
      return decode_bytes(format(values), asked, frame, sink);
    }
  }

  static constexpr Error decode_bits(const Format& f, BitView bits, FieldSink& sink) {
    if constexpr (requires { Definition::is_usable(f); }) {
      if (!Definition::is_usable(f)) return Error::invalid_argument;
    }
    const auto reply = P::decode(f, bits);
    if (!reply) return reply.error();
    put_values<Definition>(sink, f, *reply);
    sink.put_reading(P::reading(f, *reply));
    return Error::none;
  }

  static constexpr Error decode_bytes(const Format& f, Frame asked, Frame frame, FieldSink& sink) {
    const Result<Request> request = request_of(f, asked.bytes, frame.bytes);
    if (!request) return request.error();
    if (frame.bytes.empty()) {
      put_values<Definition>(sink, f, *request);
      return Error::none;
    }
    const auto reply = P::decode(f, *request, frame.bytes);
    if (!reply) return reply.error();
    put_values<Definition>(sink, f, *request, *reply);
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

  static constexpr const CommandOf<P>& find(const Command& command) { return Tables::command_table[command.id]; }

  // One for each that the command has, in its range.
  static constexpr bool are_good(const Command& command, Arguments arguments) {
    return std::equal(
        arguments.begin(), arguments.end(), command.arguments.begin(), command.arguments.end(),
        [](std::int64_t value, const Argument& one) { return value >= one.minimum && value <= one.maximum; });
  }

  static Result<std::size_t> encode(const Options& values, const Command& command, Arguments arguments,
                                    MutableBytes out) {
    if (!are_good(command, arguments)) return Error::invalid_argument;
    if constexpr (Clocked<P>) {
      return std::size_t{0};
    } else {
      return encode_bytes(format(values), find(command), arguments, out);
    }
  }
  static Result<std::size_t> encode_bytes(const Format& f, const CommandOf<P>& one, Arguments arguments,
                                          MutableBytes out) {
    if (one.missing != nullptr && !one.missing(f).empty()) return Error::unsupported;
    if (one.request == nullptr) return Error::unsupported;
    const Result<Request> request = one.request(f, arguments);
    if (!request) return request.error();
    const auto bytes = P::encode(f, *request);
    if (bytes.empty()) return asks_by_pulse<P>(f, *request) ? Error::unsupported : Error::invalid_argument;
    if (bytes.size() > out.size()) return Error::buffer_too_small;
    std::copy_n(bytes.view().begin(), bytes.size(), out.begin());
    return bytes.size();
  }

  static constexpr std::size_t request_size(const Options& values, Bytes begin) {
    if constexpr (requires { P::request_size(format(values), begin); }) {
      return P::request_size(format(values), begin);
    } else {
      return P::request_size(begin);
    }
  }

  static constexpr std::size_t reply_size(const Options& values, Bytes begin) {
    if constexpr (requires { Definition::reply_size(Format{}, begin); }) {
      return Definition::reply_size(format(values), begin);
    } else {
      return P::longest_reply;
    }
  }

  static constexpr FrameEnd frame_end(const Options& values, Direction direction, Bytes bytes) {
    if constexpr (requires { Definition::frame_end(values, direction, bytes); }) {
      return Definition::frame_end(values, direction, bytes);
    } else if constexpr (Clocked<P>) {
      return {FrameEnd::Kind::complete, bytes.size()};  // the pause of the clock ends a frame
    } else {
      if (bytes.empty()) return {FrameEnd::Kind::incomplete, 1};
      const std::size_t size =
          direction == Direction::request ? request_size(values, bytes) : reply_size(values, bytes);
      if (size == 0) return {FrameEnd::Kind::no_frame};
      return {bytes.size() < size ? FrameEnd::Kind::incomplete : FrameEnd::Kind::complete, size};
    }
  }

  static Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                                std::span<std::byte> storage) {
    if (!are_good(command, arguments)) {
      return make_host<Refusal<ItemOf<P>>>(storage, Error::invalid_argument,
                                           "an argument is missing, or outside its range; nothing was sent");
    }
    return find(command).run(format(values), arguments, storage);
  }

  static Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
    const Format f = format(values);
    if constexpr (requires { Definition::is_usable(f); }) {
      if (!Definition::is_usable(f)) return {};
    }
    return make_device<typename Definition::Encoder>(storage, f, shaft);
  }

  static constexpr Resolution resolution(const Options& values) {
    if constexpr (requires { Definition::resolution(Format{}); }) {
      return Definition::resolution(format(values));
    } else {
      return format(values).resolution();
    }
  }
  static constexpr LineSettings line_of(const Format& f) {
    if constexpr (requires { Definition::line(f); }) {
      return Definition::line(f);
    } else {
      return f.line();
    }
  }
  static constexpr LineSettings settings(const Options& values) { return line_of(format(values)); }

  static bool is_answered(const Options& values, Frame asked) {
    if constexpr (requires { Definition::is_answered(values, asked); }) {
      return Definition::is_answered(values, asked);
    } else {
      const Format f = format(values);
      const Result<Request> request = P::decode_request(f, items(asked));
      if (!request) return true;
      const Manner manner = P::manner(f, *request);
      return manner.expects_reply && !manner.any_reply;
    }
  }

  static Time pause(const Options& values, Frame asked) {
    const Format f = format(values);
    const Result<Request> request = P::decode_request(f, items(asked));
    return request ? P::manner(f, *request).pause : Time{};
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

  static constexpr Error decode_vector(const Options& values, const Vector& vector, FieldSink& sink) {
    if constexpr (std::is_same_v<ItemOf<P>, CanFrame>) {
      const CanFrame request = can_frame_of_text(vector.request);
      const CanFrame reply = can_frame_of_text(vector.reply);
      return decode(values, {.can = vector.request.empty() ? nullptr : &request},
                    {.can = vector.reply.empty() ? nullptr : &reply}, sink);
    } else if constexpr (Clocked<P>) {
      const auto request = bits_of_text(vector.request);
      const auto bits = bits_of_text(vector.reply);
      return decode(values, {.bytes = request.bytes(), .bits = request.size()},
                    {.bytes = bits.bytes(), .bits = bits.size()}, sink);
    } else {
      return decode(values, {.bytes = vector.request}, {.bytes = vector.reply}, sink);
    }
  }

  // Whether the text is understood, which comes over a model, which comes over the defaults.
  static constexpr bool resolve(std::string_view text, std::span<const OptionValue> model, Options& values) {
    for (std::size_t i = 0; i < Definition::options.infos.size(); ++i) {
      values.values[i] = Definition::options.infos[i].default_value;
    }
    for (const OptionValue& one : model) values.values[one.option] = one.value;
    return for_each_value(text, [&](std::string_view name, std::string_view value) {
      const std::size_t option = Definition::options.find(name);
      if (option == Definition::options.infos.size()) return false;
      const Result<std::int64_t> parsed = parse_value(Definition::options.infos[option], value);
      if (parsed) values.values[option] = *parsed;
      return parsed.error() == Error::none;
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
    for (const Model& model : Tables::models) {
      Options of_model;
      known = known && resolve(vector.options, model.values, of_model);
      if (!agrees(model, of_model)) continue;
      values = of_model;
      break;
    }
    VectorCheck check(vector.fields);
    return known && decode_vector(values, vector, check) == vector.error && check.all();
  }
  static_assert(std::all_of(Tables::vectors.begin(), Tables::vectors.end(), holds),
                "a vector does not decode to what it says");

  static constexpr Unit make() {
    Unit unit{.id = Definition::id,
              .name = Definition::name,
              .document = Definition::document,
              .link = Definition::link,
              .line = line_of(Format{}),
              .options = Tables::options,
              .models = Tables::models,
              .fields = Definition::fields.infos,
              .commands = Tables::commands,
              .vectors = Tables::vectors,
              .status = nullptr,
              .alarms = nullptr,
              .host_storage = Tables::host_storage,
              .device_storage = sizeof(typename Definition::Encoder),
              .decode = decode,
              .encode = encode,
              .frame_end = frame_end,
              .host = host,
              .device = device,
              .resolution = resolution,
              .settings = settings};
    constexpr bool by_manner = requires {
      P::decode_request(Format{}, Bytes{});
      P::manner(Format{}, Request{});
    };
    if constexpr (by_manner || requires { &Definition::is_answered; }) unit.is_answered = is_answered;
    if constexpr (by_manner && requires { P::manner(Format{}, Request{}).pause; }) unit.pause = pause;
    if constexpr (requires { Definition::status; }) unit.status = Definition::status;
    if constexpr (requires { Definition::alarms; }) unit.alarms = Definition::alarms;
    if constexpr (requires { Definition::memory; }) unit.memory = Definition::memory;
    if constexpr (requires { Definition::conditions; }) unit.conditions = Definition::conditions;
    if constexpr (requires { Definition::timing; }) unit.timing = Definition::timing;
    if constexpr (requires { Definition::is_checked; }) unit.is_checked = Definition::is_checked;
    if constexpr (requires { &Definition::bits; }) unit.bits = Definition::bits;
    if constexpr (requires { Definition::registers; }) unit.registers = Definition::registers;
    if constexpr (requires { Definition::over_spi; }) unit.over_spi = Definition::over_spi;
    if constexpr (requires { Definition::probe; }) unit.probe = Definition::probe;
    if constexpr (requires { Definition::control_bit; }) unit.control_bit = Definition::control_bit;
    if constexpr (requires { Definition::streams; }) unit.streams = Definition::streams;
    if constexpr (requires { Definition::extra_wires; }) unit.extra_wires = Definition::extra_wires;
    if constexpr (requires { Definition::explain(Format{}, Error::none, items({}), items({})); }) {
      unit.explain = explain;
    }
    return unit;
  }
};

}  // namespace absenc::author
