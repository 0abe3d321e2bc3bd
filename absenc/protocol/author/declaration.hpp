// SPDX-License-Identifier: Apache-2.0
// The declaration of a unit by its author. docs/protocol-template is a complete example.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "absenc/protocol/author/bit_host.hpp"
#include "absenc/protocol/author/command.hpp"
#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/author/text.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// The properties of a unit of the protocol `P`, from which Descriptor (unit.hpp) makes the Unit. `P`: see dialog.hpp,
/// clocked_host.hpp or can_dialog.hpp. `VirtualEncoder` is constructed from (format, shaft). `Host`: as in Report.
template <class P, class VirtualEncoder, class Host = Conversation<ItemOf<P>>>
struct Declaration {
  /// Class with the functions of the protocol.
  using Protocol = P;
  /// C++ class of the protocol's virtual encoder.
  using Encoder = VirtualEncoder;
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// C++ type of the protocol's requests.
  using Request = typename P::Request;

  std::string_view id{};        ///< Identifier: the part of an address before the colon.
  std::string_view name{};      ///< names of maker and protocol, for people
  std::string_view document{};  ///< title of the protocol's document
  /// Names of makers and families by which users find the unit: "Tamagawa", "Smart-Abs".
  std::span<const std::string_view> known_as{};
  std::string_view lookalikes{};      ///< Unit::lookalikes
  LinkKind link{};                    ///< Kind of link between host and encoder.
  std::span<const Option> options{};  ///< options of the unit: OptionsOf::infos (option.hpp)
  /// Returns the format with these option values, for example `format_of`.
  Format (*format)(const Options&) = nullptr;
  std::span<const ModelText> models{};       ///< models, with their option values as text (option.hpp)
  std::span<const FieldInfo> fields{};       ///< fields of the unit: FieldsOf::infos (field.hpp)
  std::span<const CommandOf<P>> commands{};  ///< commands of the unit (command.hpp)
  /// Test vectors (text.hpp).
  std::span<const VectorText> vectors{};
  /// Whether frames of vectors are plain texts, not hexadecimal; on clocked links they always are.
  bool frames_are_texts = false;
  std::size_t frames_size = 0;  ///< most bytes of storage that the coroutine frames of one procedure need
  Report<P, Host> report{};     ///< Functions that deliver requests, replies and errors as fields and texts.

  // ---- Functions of the format

  /// Returns the settings of the line. Null: `format.line()` does.
  LineSettings (*line)(const Format&) = nullptr;
  /// Returns the resolution of the encoder. Null: `format.resolution()` does.
  Resolution (*resolution)(const Format&) = nullptr;
  /// Returns whether the options do not contradict each other. Null: they never do.
  bool (*is_usable)(const Format&) = nullptr;
  /// Returns the request that a reply captured without one is taken to answer, or an error.
  Result<Request> (*guess_request)(const Format&, ContentOf<P> reply) = nullptr;
  /// Returns the length in bytes of the reply that begins with `begin`; 0: no reply begins with these bytes. Null:
  /// every reply is assumed to have the length P::longest_reply.
  std::size_t (*reply_size)(const Format&, Bytes begin) = nullptr;
  /// Returns the error to report for the reply to an invalid request; `error` is that of the request. Null: `error` is
  /// reported.
  Error (*answer_to_bad)(const Format&, Bytes request, Error error, Bytes reply) = nullptr;
  /// Checks a frame and puts its fields into the sink. Null: the functions of P check it, and `report` puts the fields.
  Error (*decode)(const Format&, Frame request, Frame reply, FieldSink&) = nullptr;
  /// For clocked links with `control_bit`: checks a request and its reply of which each frame carries one bit, and puts
  /// their fields into the sink.
  Error (*decode_control)(Frame request, Frame reply, FieldSink&) = nullptr;

  /// For clocked links: writes the host's bits of a command into `out`, as text of 0 and 1, and returns their number.
  /// Null: the host only clocks.
  Result<std::size_t> (*encode)(const Format&, const Command&, Arguments, MutableBytes out) = nullptr;

  // ---- As in Unit (protocol/unit.hpp)

  /// Returns where a frame ends. Null: the lengths of requests and replies decide; on clocked links all bytes are one
  /// frame.
  FrameEnd (*frame_end)(const Options&, Direction, Bytes) = nullptr;
  /// Returns whether the encoder answers a request. Null: as Protocol::manner states, if the host sends requests.
  bool (*is_answered)(const Options&, Frame request) = nullptr;
  /// Returns whether the checks must detect that this bit of a valid reply is flipped; null: they must detect every
  /// flipped bit.
  bool (*is_checked)(const Options&, Frame request, Frame reply, std::size_t bit) = nullptr;
  /// Returns the bits of a valid reply that carry a field. Without this function they are unknown.
  BitRanges (*bits)(const Options&, Frame request, Frame reply, const FieldInfo&) = nullptr;
  /// Finds the values of options that fit captured frames; null: frames do not show option values.
  bool (*probe)(Options&, std::span<const Capture>, EvidenceSink&) = nullptr;
  /// Returns whether the encoder sends replies without a request; null: it never does.
  bool (*streams)(const Options&) = nullptr;
  /// Returns the wires beside the data line that an encoder with these options needs; null: none.
  ExtraWires (*extra_wires)(const Options&) = nullptr;
  /// For clocked links on which the host sends a bit by the level of the clock line in each pause: returns the index of
  /// the bit of a reply that answers the host's bit; null: no reply has one.
  std::optional<std::size_t> (*control_bit)(const Options&, Frame reply) = nullptr;
  /// For bidirectional clocked links: returns the ranges of bits that the host sends, in their order. `burst`: the bits
  /// of all clocks between two pauses of the clock.
  BitRanges (*host_bits)(const Options&, Frame burst) = nullptr;
  /// Returns the alarms that an encoder with these options can report; null: it can report all.
  std::uint32_t (*reportable)(const Options&) = nullptr;
  /// Completes a reading by values of earlier readings; null: each reading is complete.
  Reading (*remembered)(const Reading& before, Reading now) = nullptr;
  /// Returns the options with the properties that a reading shows; null: readings show none that hosts ask for.
  Options (*learned)(const Options&, const Reading&) = nullptr;
  /// Constructs a Follower, which finds frames that are composed of several exchanges; null: there are no such frames.
  Follower* (*follower)(const Options&, std::span<std::byte>) = nullptr;
  /// Number of bytes of storage that `follower` needs for the Follower that it constructs.
  std::size_t follower_storage = 0;
  const FieldInfo* status = nullptr;          ///< Field that describes the flags of Reading::status; null: none.
  const FieldInfo* alarms = nullptr;          ///< Field that describes the flags of Reading::alarms; null: none.
  const FieldInfo* second_status = nullptr;   ///< Field of the status of channel 2; null: none.
  const FieldInfo* second_alarms = nullptr;   ///< Field of the alarms of channel 2; null: none.
  std::span<const MemoryArea> memory{};       ///< Areas of the encoder's memory that hosts can access.
  std::span<const RegisterInfo> registers{};  ///< Registers of the encoder that hosts can access.
  std::span<const Condition> conditions{};    ///< Conditions of the virtual encoder's environment that users can set.
  LineTiming timing{};                        ///< Times of the line, which decoding captures needs.
  /// The unit that describes the same encoder behind an SPI controller; null: there is no such unit.
  const Unit* over_spi = nullptr;
};

/// Returns the format whose members have the values `values` of `options`.
template <const auto& options>
constexpr auto format_of(const Options& values) {
  return options.format(values);
}

}  // namespace absenc::author
