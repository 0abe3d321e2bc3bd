// SPDX-License-Identifier: Apache-2.0
// All that an author declares of a unit, in one aggregate with designated initializers: a misspelt member does not
// compile. docs/protocol-template shows a whole one.
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

/// Declares a unit of the protocol `P` (dialog.hpp, device.hpp; clocked_host.hpp). `VirtualEncoder` is made of (format,
/// shaft): BusDevice, ClockedDevice. `Host` is that of its Report.
template <class P, class VirtualEncoder, class Host = Conversation<ItemOf<P>>>
struct Declaration {
  /// The protocol.
  using Protocol = P;
  using Encoder = VirtualEncoder;
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// A request of the protocol.
  using Request = typename P::Request;

  std::string_view id{};
  std::string_view name{};                       ///< maker and protocol, for people
  std::string_view document{};                   ///< the source
  std::span<const std::string_view> known_as{};  ///< makers and families: "Tamagawa", "Smart-Abs"
  LinkKind link{};
  std::span<const Option> options{};           ///< OptionsOf::infos (option.hpp)
  Format (*format)(const Options&) = nullptr;  ///< `format_of<options>` where the options are members of the format
  std::span<const ModelText> models{};         ///< option.hpp
  std::span<const FieldInfo> fields{};         ///< FieldsOf::infos (field.hpp)
  std::span<const CommandOf<P>> commands{};    ///< command.hpp
  std::span<const VectorText> vectors{};       ///< text.hpp; they hold, or it does not compile
  bool frames_are_texts = false;               ///< frames of vectors are no hexadecimal; clocked ones are 0 and 1
  std::size_t frames_size = 0;                 ///< bytes of storage that the procedures' frames need at the most
  Report<P, Host> report{};

  // ---- What depends on the format

  /// Null: `format.line()`.
  LineSettings (*line)(const Format&) = nullptr;
  /// Null: `format.resolution()`.
  Resolution (*resolution)(const Format&) = nullptr;
  /// Returns whether a virtual encoder is made, and clocked frames are decoded. Null: always.
  bool (*is_usable)(const Format&) = nullptr;
  /// Returns the request that a reply belongs to, by the reply alone; or an error. Needed where `decode` is null,
  /// except on clocked lines.
  Result<Request> (*guess_request)(const Format&, Bytes reply) = nullptr;
  /// Returns the length of any reply that begins so; 0: none does. Null: the longest.
  std::size_t (*reply_size)(const Format&, Bytes begin) = nullptr;
  /// Returns the error of a bad request, by the reply to it. Null: the error of the request.
  Error (*answer_to_bad)(const Format&, Bytes request, Error error, Bytes reply) = nullptr;
  /// Checks a frame and puts its fields. Null: by the protocol and the report.
  Error (*decode)(const Format&, Frame request, Frame reply, FieldSink&) = nullptr;

  /// Clocked links: writes the bits that the host says for a command, as text of 0 and 1. Null: it only clocks.
  Result<std::size_t> (*encode)(const Format&, const Command&, Arguments, MutableBytes out) = nullptr;

  // ---- As in Unit (protocol/unit.hpp)

  FrameEnd (*frame_end)(const Options&, Direction, Bytes) = nullptr;  ///< null: by the sizes of requests and replies
  bool (*is_answered)(const Options&, Frame request) = nullptr;       ///< null: by the manner of the request
  bool (*is_checked)(const Options&, Frame request, Frame reply, std::size_t bit) = nullptr;
  BitRanges (*bits)(const Options&, Frame request, Frame reply, const FieldInfo&) = nullptr;
  bool (*probe)(Options&, std::span<const Capture>, EvidenceSink&) = nullptr;
  bool (*streams)(const Options&) = nullptr;
  ExtraWires (*extra_wires)(const Options&) = nullptr;
  std::optional<std::size_t> (*control_bit)(const Options&, Frame reply) = nullptr;
  std::uint32_t (*reportable)(const Options&) = nullptr;
  Reading (*remembered)(const Reading& before, Reading now) = nullptr;
  Follower* (*follower)(const Options&, std::span<std::byte>) = nullptr;
  std::size_t follower_storage = 0;
  const FieldInfo* status = nullptr;
  const FieldInfo* alarms = nullptr;
  const FieldInfo* second_status = nullptr;
  const FieldInfo* second_alarms = nullptr;
  std::span<const MemoryArea> memory{};
  std::span<const RegisterInfo> registers{};
  std::span<const Condition> conditions{};
  LineTiming timing{};
  const Unit* over_spi = nullptr;
};

/// The format whose members the options set.
template <const auto& options>
constexpr auto format_of(const Options& values) {
  return options.format(values);
}

}  // namespace absenc::author
