// SPDX-License-Identifier: Apache-2.0
// Makes the descriptor of a unit (Unit) from its Declaration.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>
#include <type_traits>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/author/bit_host.hpp"
#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/author/command.hpp"
#include "absenc/protocol/author/declaration.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/author/tables.hpp"
#include "absenc/protocol/author/text.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/protocol/vector_check.hpp"

namespace absenc::author {

/// Functions of the unit that the Declaration `declared` describes; `make` returns its Unit.
template <const auto& declared>
struct Descriptor {
  /// Type of the declaration.
  using Declared = std::remove_cvref_t<decltype(declared)>;
  /// Class with the functions of the protocol.
  using P = typename Declared::Protocol;
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// C++ type of the protocol's requests.
  using Request = typename P::Request;
  /// Tables of commands, models and vectors of the declaration.
  using Made = Tables<declared>;

  static_assert(!declared.id.empty() && !declared.name.empty() && !declared.document.empty(),
                "a unit has id, name and document");
  static_assert(declared.format != nullptr, "a unit needs `format`: format_of<options>, or a function");

  static_assert(declared.decode != nullptr || declared.report.put_reply != nullptr, "a report needs put_reply");
  static_assert(Clocked<P> || declared.decode != nullptr || declared.report.put_request != nullptr,
                "a report needs put_request");

  /// Whether replies to most requests have the position.
  static constexpr bool carries_position = requires { P::replies_carry_position; };
  /// Whether hosts send requests that functions of P decode. False on clocked lines, and if the declaration has a
  /// `decode` of its own.
  static constexpr bool has_requests = !Clocked<P> && declared.decode == nullptr;
  /// Whether frames of the protocol are bits, not bytes or CAN frames.
  static constexpr bool has_bits = Clocked<P> || Bitwise<P>;

  // ---- Functions of the descriptor

  /// Checks a frame and puts its fields into `sink`, as Unit::decode. Returns the first error.
  static constexpr Error decode(const Options& values, Frame asked, Frame frame, FieldSink& sink) {
    return decode_by(declared.format(values), asked, frame, sink);
  }
  /// Checks a frame and puts its fields into `sink`. `AnyFormat`: Format or Format::Compiled.
  template <class AnyFormat>
  static constexpr Error decode_by(const AnyFormat& f, Frame asked, Frame frame, FieldSink& sink) {
    if constexpr (declared.decode_control != nullptr) {
      if (!asked.empty()) return declared.decode_control(asked, frame, sink);
    }
    if constexpr (declared.decode != nullptr) {
      return declared.decode(f, asked, frame, sink);
    } else if constexpr (Clocked<P>) {
      return decode_bits(f, to_bits(frame), sink);
    } else {
      return decode_exchange(f, asked, frame, sink);
    }
  }

  /// Whether the protocol compiles formats, to decode many frames faster.
  static constexpr bool compiles_formats = requires { typename Format::Compiled; };
  /// Decodes frames by the compiled format of the options.
  template <class F = Format>
  class Decoder final : public FrameDecoder {
   public:
    /// Compiles the format that the options describe.
    explicit Decoder(const Options& values) : format_(declared.format(values)) {}
    Error decode(Frame request, Frame reply, FieldSink& sink) const override {
      return decode_by(format_, request, reply, sink);
    }

   private:
    typename F::Compiled format_;
  };
  /// Constructs a decoder in `storage`, as Unit::decoder.
  static FrameDecoder* decoder(const Options& values, std::span<std::byte> storage) {
    return absenc::detail::make_in<Decoder<>>(storage, values);
  }

  /// Returns whether the options of the format `f` do not contradict each other.
  static constexpr bool is_usable(const Format& f) {
    if constexpr (declared.is_usable != nullptr) return declared.is_usable(f);
    return true;
  }

  /// Checks a transfer of a clocked link, and puts its fields and reading into `sink`.
  template <class AnyFormat>
  static constexpr Error decode_bits(const AnyFormat& f, const BitView& bits, FieldSink& sink) {
    if (!is_usable(f)) return Error::invalid_argument;
    const auto reply = P::decode(f, bits);
    if (!reply) return reply.error();
    declared.report.put_reply(sink, f, {}, *reply);
    sink.put_reading(P::reading(f, *reply));
    return Error::none;
  }

  /// Returns what the protocol's functions take of a frame: its bytes, or its bits.
  static constexpr auto content(const Frame& frame) {
    if constexpr (Bitwise<P>) {
      return to_bits(frame);
    } else {
      return frame.bytes;
    }
  }

  /// Checks an exchange with a request and its reply, and puts its fields into `sink`.
  static constexpr Error decode_exchange(const Format& f, Frame asked, Frame frame, FieldSink& sink) {
    const Result<Request> request = request_of(f, asked, frame);
    if (!request) return request.error();
    if (frame.bytes.empty()) {
      declared.report.put_request(sink, f, *request);
      return Error::none;
    }
    const auto reply = P::decode(f, *request, content(frame));
    if (!reply) return reply.error();
    declared.report.put_reply(sink, f, *request, *reply);
    const Reading reading = P::reading(f, *request, *reply);
    if (reading.singleturn_bits != 0 || reading.multiturn_bits != 0) sink.put_reading(reading);
    return Error::none;
  }

  /// Returns the request of an exchange, or the one that a reply captured without it is taken to answer, or an error.
  static constexpr Result<Request> request_of(const Format& f, Frame asked, Frame reply) {
    static_assert(declared.guess_request != nullptr, "a unit that sends requests needs `guess_request`");
    if (asked.bytes.empty()) {
      if (reply.bytes.empty()) return Error::wrong_length;
      return declared.guess_request(f, content(reply));
    }
    const Result<Request> request = P::decode_request(f, content(asked));
    if constexpr (declared.answer_to_bad != nullptr) {
      if (!request) return declared.answer_to_bad(f, asked.bytes, request.error(), reply.bytes);
    }
    return request;
  }

  /// Returns the declaration of `command`.
  static constexpr const CommandOf<P>& find(const Command& command) { return declared.commands[command.id]; }

  /// Returns whether the arguments of the command have the right number and ranges.
  static constexpr bool are_good(const Command& command, Arguments arguments) {
    return std::equal(
        arguments.begin(), arguments.end(), command.arguments.begin(), command.arguments.end(),
        [](std::int64_t value, const Argument& one) { return value >= one.minimum && value <= one.maximum; });
  }

  /// Writes the request of a command into `out` and returns its length, as Unit::encode.
  static Result<std::size_t> encode(const Options& values, const Command& command, Arguments arguments,
                                    MutableBytes out) {
    if (!are_good(command, arguments)) return Error::invalid_argument;
    if constexpr (declared.encode != nullptr) {
      return declared.encode(declared.format(values), command, arguments, out);
    } else if constexpr (Clocked<P>) {
      return std::size_t{0};
    } else {
      return encode_bytes(declared.format(values), find(command), arguments, out);
    }
  }
  /// Writes the bytes of a command's request into `out` and returns their number.
  static Result<std::size_t> encode_bytes(const Format& f, const CommandOf<P>& one, Arguments arguments,
                                          MutableBytes out) {
    if (one.missing != nullptr && !one.missing(f).empty()) return Error::unsupported;
    if (one.request == nullptr) return Error::unsupported;
    const Result<Request> request = one.request(f, arguments);
    if (!request) return request.error();
    if constexpr (Bitwise<P>)
      return bits_as_text(P::encode(f, *request), out);
    else
      return bytes_of(f, *request, out);
  }
  /// Writes the bytes of a request into `out` and returns their number.
  static Result<std::size_t> bytes_of(const Format& f, const Request& request, MutableBytes out) {
    const auto bytes = P::encode(f, request);
    if (bytes.empty()) return asks_by_pulse<P>(f, request) ? Error::unsupported : Error::invalid_argument;
    if (bytes.size() > out.size()) return Error::buffer_too_small;
    std::copy_n(bytes.view().begin(), bytes.size(), out.begin());
    return bytes.size();
  }

  /// Writes the bits of a request, with its supplement, into `out` as text of 0 and 1 and returns their number.
  static Result<std::size_t> bits_as_text(const BitRequest& request, MutableBytes out) {
    const std::size_t size = request.bits.size() + request.supplement.size();
    if (size == 0) return Error::invalid_argument;
    if (size > out.size()) return Error::buffer_too_small;
    std::size_t written = 0;
    for (const BitView& bits : {request.bits.view(), request.supplement.view()}) {
      for (std::size_t i = 0; i < bits.size; ++i) out[written++] = static_cast<std::uint8_t>(bits[i] ? '1' : '0');
    }
    return written;
  }

  /// Returns the length in bytes of the request that begins with `begin`, as P::request_size.
  static constexpr std::size_t request_size(const Options& values, Bytes begin) {
    return P::request_size(declared.format(values), begin);
  }

  /// Returns the declaration's `reply_size`; P::longest_reply if it has none.
  static constexpr std::size_t reply_size(const Options& values, Bytes begin) {
    if constexpr (declared.reply_size != nullptr) {
      return declared.reply_size(declared.format(values), begin);
    } else {
      return P::longest_reply;
    }
  }

  /// Returns where the frame ends that begins with the first of `bytes`.
  static constexpr FrameEnd frame_end(const Options& values, Direction direction, Bytes bytes) {
    if constexpr (declared.frame_end != nullptr) {
      return declared.frame_end(values, direction, bytes);
    } else if constexpr (has_bits) {
      // Each capture of a clocked link is one frame, because a pause of the clock ends it.
      return {FrameEnd::Kind::complete, bytes.size()};
    } else {
      if (bytes.empty()) return {FrameEnd::Kind::incomplete, 1};
      const std::size_t size =
          direction == Direction::request ? request_size(values, bytes) : reply_size(values, bytes);
      if (size == 0) return {FrameEnd::Kind::no_frame};
      return {bytes.size() < size ? FrameEnd::Kind::incomplete : FrameEnd::Kind::complete, size};
    }
  }

  /// Constructs the conversation of a command in `storage`; a Refusal if the arguments are wrong.
  static Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                                std::span<std::byte> storage) {
    if (!are_good(command, arguments)) {
      return make_host<Refusal<ItemOf<P>>>(storage, Error::invalid_argument,
                                           "an argument is missing, or outside its range; nothing was sent");
    }
    return find(command).run(declared.format(values), arguments, storage);
  }

  /// Constructs a virtual encoder in `storage`. Returns an empty Any if that is impossible.
  static Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
    const Format f = declared.format(values);
    if (!is_usable(f)) return {};
    return make_device<typename Declared::Encoder>(storage, f, shaft);
  }

  /// Returns the resolution of an encoder with these options.
  static constexpr Resolution resolution(const Options& values) {
    if constexpr (declared.resolution != nullptr) {
      return declared.resolution(declared.format(values));
    } else {
      return declared.format(values).resolution();
    }
  }
  /// Returns the settings of the line for the format `f`.
  static constexpr LineSettings line_of(const Format& f) {
    if constexpr (declared.line != nullptr) {
      return declared.line(f);
    } else {
      return f.line();
    }
  }
  /// Returns the settings of the line with these options.
  static constexpr LineSettings settings(const Options& values) { return line_of(declared.format(values)); }

  /// Returns false if Protocol::manner states that the request has no reply, or that any reply is accepted; else true.
  static bool is_answered(const Options& values, Frame asked) {
    const Format f = declared.format(values);
    const Result<Request> request = P::decode_request(f, content(asked));
    if (!request) return true;
    const Manner manner = P::manner(f, *request);
    return manner.expects_reply && !manner.any_reply;
  }
  /// Returns Manner::pause of a request; 0 for an invalid one.
  static Time pause(const Options& values, Frame asked) {
    const Format f = declared.format(values);
    const Result<Request> request = P::decode_request(f, content(asked));
    return request ? P::manner(f, *request).pause : Time{};
  }

  /// Returns the content of a frame as items of the link: bytes, or a CAN frame.
  static constexpr std::span<const ItemOf<P>> items(const Frame& frame) {
    if constexpr (std::is_same_v<ItemOf<P>, CanFrame>) {
      return {frame.can, frame.can != nullptr ? 1u : 0u};
    } else {
      return frame.bytes;
    }
  }

  /// Returns the unit's explanation of an error; without texts if it has none.
  static Explanation explain(const Options& values, Error error, Frame asked, Frame reply) {
    return declared.report.explain(declared.format(values), error, items(asked), items(reply));
  }

  /// Decodes the frames of a vector, and puts the fields into `sink`. Returns the first error.
  static constexpr Error decode_vector(const Options& values, const Vector& vector, FieldSink& sink) {
    if constexpr (std::is_same_v<ItemOf<P>, CanFrame>) {
      const CanFrame request = can_frame_of_text(vector.request);
      const CanFrame reply = can_frame_of_text(vector.reply);
      return decode(values, {.can = vector.request.empty() ? nullptr : &request},
                    {.can = vector.reply.empty() ? nullptr : &reply}, sink);
    } else if constexpr (has_bits) {
      const auto request = bits_of_text(vector.request);
      const auto bits = bits_of_text(vector.reply);
      return decode(values, {.bytes = request.bytes(), .bits = request.size()},
                    {.bytes = bits.bytes(), .bits = bits.size()}, sink);
    } else {
      return decode(values, {.bytes = vector.request}, {.bytes = vector.reply}, sink);
    }
  }

  /// Sets `values` to the defaults of the options, then to the values of `model`, then to those of `text`. Returns
  /// whether the whole `text` is valid.
  static constexpr bool resolve(std::string_view text, std::span<const OptionValue> model, Options& values) {
    for (std::size_t i = 0; i < declared.options.size(); ++i) {
      values.values[i] = declared.options[i].default_value;
    }
    for (const OptionValue& one : model) values.values[one.option] = one.value;
    return for_each_value(text, [&](std::string_view name, std::string_view value) {
      const std::size_t option = Made::find_option(name);
      if (option == declared.options.size()) return false;
      const Result<std::int64_t> parsed = parse_value(declared.options[option], value);
      if (parsed) values.values[option] = *parsed;
      return parsed.error() == Error::none;
    });
  }
  /// Returns whether `values` has the option values of the model.
  static constexpr bool agrees(const Model& model, const Options& values) {
    return std::all_of(model.values.begin(), model.values.end(),
                       [&](const OptionValue& one) { return values.values[one.option] == one.value; });
  }

  /// Returns whether decoding a vector gives the fields or error that it states. If the vector leaves bytes open,
  /// only its options are checked.
  static constexpr bool holds(const Vector& vector) {
    Options values;
    bool known = resolve(vector.options, {}, values);
    // The first model whose values match the text is used, as by resolve_options.
    for (const Model& model : Made::models) {
      Options of_model;
      known = known && resolve(vector.options, model.values, of_model);
      if (!agrees(model, of_model)) continue;
      values = of_model;
      break;
    }
    if (!vector.is_complete()) return known;
    VectorCheck check(vector.fields);
    return known && decode_vector(values, vector, check) == vector.error && check.all();
  }
  /// Number, from 0, of the first vector that does not decode to what it expects; the number of vectors if all do.
  static constexpr std::size_t first_wrong_vector = static_cast<std::size_t>(
      std::find_if_not(Made::vectors.begin(), Made::vectors.end(), holds) - Made::vectors.begin());
  static_assert(first_wrong_vector == Made::vectors.size(),
                "a vector does not decode to what it says: the compiler shows its number, from 0, before that of all");

  /// Returns the shortest silence that a host keeps between a reply and its next request.
  static Time rest(const Options& values) {
    const auto times = P::host_times(declared.format(values));
    return std::max(times.silence, times.pause);
  }

  /// Returns the times of the virtual encoder; default times, which pass the checks of `make`, if the protocol states
  /// none.
  static constexpr DeviceTimes device_times() {
    if constexpr (requires { P::device_times(Format{}); }) return P::device_times(Format{});
    return {};
  }
  /// Returns the descriptor of the unit.
  static constexpr Unit make() {
    static_assert(declared.line != nullptr || device_times().character == Time{} ||
                      device_times().character == line_of(Format{}).byte_time(),
                  "DeviceTimes::character is the duration of one byte: format.line().byte_time()");
    static_assert(device_times().frame == 0 || device_times().gap > device_times().frame_pause,
                  "DeviceTimes::gap ends an incomplete request, so it is longer than DeviceTimes::frame_pause");
    Unit unit{.id = declared.id,
              .name = declared.name,
              .document = declared.document,
              .known_as = declared.known_as,
              .lookalikes = declared.lookalikes,
              .link = declared.link,
              .line = line_of(Format{}),
              .options = declared.options,
              .models = Made::models,
              .fields = declared.fields,
              .commands = Made::commands,
              .memory = declared.memory,
              .registers = declared.registers,
              .vectors = Made::vectors,
              .status = declared.status,
              .alarms = declared.alarms,
              .reportable = declared.reportable,
              .second_status = declared.second_status,
              .second_alarms = declared.second_alarms,
              .host_storage = Made::host_storage,
              .device_storage = sizeof(typename Declared::Encoder),
              .decode = decode,
              .encode = encode,
              .frame_end = frame_end,
              .host = host,
              .device = device,
              .resolution = resolution,
              .is_checked = declared.is_checked,
              .bits = declared.bits,
              .settings = settings,
              .over_spi = declared.over_spi,
              .probe = declared.probe,
              .extra_wires = declared.extra_wires,
              .timing = declared.timing,
              .streams = declared.streams,
              .is_answered = declared.is_answered,
              .services_carry_position = carries_position,
              .conditions = declared.conditions,
              .control_bit = declared.control_bit,
              .host_bits = declared.host_bits,
              .remembered = declared.remembered,
              .learned = declared.learned,
              .follower = declared.follower,
              .follower_storage = declared.follower_storage};
    if constexpr (declared.report.explain != nullptr) unit.explain = explain;
    if constexpr (has_requests && declared.is_answered == nullptr) unit.is_answered = is_answered;
    if constexpr (has_requests) unit.pause = pause;
    if constexpr (requires { P::host_times(Format{}).silence; }) unit.rest = rest;
    if constexpr (compiles_formats) {
      unit.decoder = decoder;
      unit.decoder_storage = sizeof(Decoder<>);
    }
    return unit;
  }
};

}  // namespace absenc::author
