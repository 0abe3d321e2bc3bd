// SPDX-License-Identifier: Apache-2.0
// The declaration of a unit by its author: one aggregate with designated initializers, so that a misspelt member does
// not compile. docs/protocol-template is a complete example.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "absenc/protocol/author/command.hpp"
#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/author/text.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// Declares a unit of the protocol `P` (dialog.hpp, device.hpp; clocked_host.hpp). `VirtualEncoder` is constructed from
/// (format, shaft): BusDevice, ClockedDevice. `Host` is the Host of the Report.
template <class P, class VirtualEncoder, class Host = Conversation<ItemOf<P>>>
struct Declaration {
  /// The protocol.
  using Protocol = P;
  /// Its virtual encoder.
  using Encoder = VirtualEncoder;
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// A request of the protocol.
  using Request = typename P::Request;

  std::string_view id{};                         ///< Identifier: the part of an address before the colon.
  std::string_view name{};                       ///< maker and protocol, for people
  std::string_view document{};                   ///< title of the document
  std::span<const std::string_view> known_as{};  ///< makers and families to find it by: "Tamagawa", "Smart-Abs"
  LinkKind link{};                               ///< Kind of link between host and encoder.
  std::span<const Option> options{};             ///< OptionsOf::infos (option.hpp)
  Format (*format)(const Options&) = nullptr;    ///< `format_of<options>` if the options are members of the format
  std::span<const ModelText> models{};           ///< option.hpp
  std::span<const FieldInfo> fields{};           ///< FieldsOf::infos (field.hpp)
  std::span<const CommandOf<P>> commands{};      ///< command.hpp
  std::span<const VectorText> vectors{};         ///< text.hpp; a vector that does not decode as stated does not compile
  bool frames_are_texts = false;  ///< frames of vectors are not hexadecimal; those of clocked links are 0 and 1
  std::size_t frames_size = 0;    ///< most bytes of storage that the coroutine frames of the procedures need
  Report<P, Host> report{};       ///< How requests, replies and findings are shown.

  // ---- Functions of the format

  /// Null: `format.line()`.
  LineSettings (*line)(const Format&) = nullptr;
  /// Null: `format.resolution()`.
  Resolution (*resolution)(const Format&) = nullptr;
  /// Returns whether a virtual encoder can be made, and clocked frames decoded. Null: always.
  bool (*is_usable)(const Format&) = nullptr;
  /// Returns the request that a reply answers, from the reply alone, or an error. Required if `decode` is null, except
  /// on clocked lines.
  Result<Request> (*guess_request)(const Format&, Bytes reply) = nullptr;
  /// Returns the length of a reply that begins with these bytes; 0: no reply does. Null: the longest.
  std::size_t (*reply_size)(const Format&, Bytes begin) = nullptr;
  /// Returns the error of an invalid request, from the reply to it. Null: the error of the request.
  Error (*answer_to_bad)(const Format&, Bytes request, Error error, Bytes reply) = nullptr;
  /// Checks a frame and puts its fields. Null: the protocol and the report do.
  Error (*decode)(const Format&, Frame request, Frame reply, FieldSink&) = nullptr;

  /// Clocked links: writes the bits that the host sends for a command, as text of 0 and 1. Null: the host only clocks.
  Result<std::size_t> (*encode)(const Format&, const Command&, Arguments, MutableBytes out) = nullptr;

  // ---- As in Unit (protocol/unit.hpp)

  FrameEnd (*frame_end)(const Options&, Direction, Bytes) = nullptr;  ///< null: by the sizes of requests and replies
  bool (*is_answered)(const Options&, Frame request) = nullptr;       ///< null: by the manner of the request
  /// Returns whether a flip of this bit of a good reply must be noticed; null: of every bit.
  bool (*is_checked)(const Options&, Frame request, Frame reply, std::size_t bit) = nullptr;
  /// Returns the bits of a field in request and reply; null: unknown.
  BitRanges (*bits)(const Options&, Frame request, Frame reply, const FieldInfo&) = nullptr;
  /// Finds options in captured frames; null: none can be found.
  bool (*probe)(Options&, std::span<const Capture>, EvidenceSink&) = nullptr;
  /// Returns whether the encoder sends without requests; null: never.
  bool (*streams)(const Options&) = nullptr;
  /// Returns the wires that these options need beside the data; null: none.
  ExtraWires (*extra_wires)(const Options&) = nullptr;
  /// Returns the index of the bit by which the encoder answers in each pause; null: no reply has one.
  std::optional<std::size_t> (*control_bit)(const Options&, Frame reply) = nullptr;
  /// Returns the alarms that replies can report; null: all.
  std::uint32_t (*reportable)(const Options&) = nullptr;
  /// Completes a reading by values of earlier readings; null: each reading is complete.
  Reading (*remembered)(const Reading& before, Reading now) = nullptr;
  /// Makes a follower, which completes replies of a capture; null: none is needed.
  Follower* (*follower)(const Options&, std::span<std::byte>) = nullptr;
  std::size_t follower_storage = 0;           ///< Bytes that a follower needs.
  const FieldInfo* status = nullptr;          ///< Field of the status; null: none.
  const FieldInfo* alarms = nullptr;          ///< Field of the alarms; null: none.
  const FieldInfo* second_status = nullptr;   ///< Field of the second status; null: none.
  const FieldInfo* second_alarms = nullptr;   ///< Field of the second alarms; null: none.
  std::span<const MemoryArea> memory{};       ///< Areas of the memory that hosts can reach.
  std::span<const RegisterInfo> registers{};  ///< Registers that hosts can reach.
  std::span<const Condition> conditions{};    ///< Conditions that a virtual encoder can be given.
  LineTiming timing{};                        ///< Times of the line, for captures.
  const Unit* over_spi = nullptr;             ///< The same encoder on SPI; null: none.
};

/// Returns the format whose members the options set.
template <const auto& options>
constexpr auto format_of(const Options& values) {
  return options.format(values);
}

}  // namespace absenc::author
