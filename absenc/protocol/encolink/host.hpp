// SPDX-License-Identifier: Apache-2.0
// Host side of EncoLink: requests for one frame, and what successive frames carry.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/encolink/frame.hpp"

namespace absenc::encolink {

/// Purpose of a request. Every request asks for a position frame except `identity`.
enum class Ask : std::uint8_t {
  position,
  reset,     ///< Requests a position, and that channels 2 and 3 restart in the next frame.
  identify,  ///< Requests a position, and that the next frame is the identity.
  identity,
};

/// The protocol as author/dialog.hpp demands it.
struct Frames {
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = encolink::Format;
  /// A request to the encoder.
  struct Request {
    Ask ask = Ask::position;  ///< Purpose of the request.
    std::uint8_t ra = 0;      ///< One byte of a register access.
  };
  /// Type of replies; empty for the requests `identify` and `identity`.
  using Reply = Position;
  /// Number of bytes of the longest reply, an identity; one more byte may follow it.
  static constexpr std::size_t longest_reply = identity_bytes;

  /// Returns the host's timeouts, and the silence before a request.
  static constexpr author::HostTimes host_times(const Format& format) {
    return {.answer_limit = answer_limit, .gap_limit = gap_limit, .silence = pause(format)};
  }
  /// Returns how a host sends a request.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    return {.holds_line = request.ask == Ask::identify};  // the next request must be the one for the identity
  }
  /// Returns the bytes of `request` as they are sent.
  static std::array<std::uint8_t, request_bytes> encode(const Format&, const Request& request);
  /// Returns the length of the reply to `request` in bytes; 0 if only silence ends the reply.
  static std::size_t expected(const Format& format, const Request& request, Bytes);
  /// Decodes a reply; the content of one to `identify` is ignored.
  static Result<Position> decode(const Format& format, const Request& request, Bytes reply);
  /// Returns whether an invalid reply is complete, as on SPI, where a transfer has a fixed length.
  static bool is_whole(const Format& format, Error) { return format.interface == Interface::spi; }
  static constexpr bool replies_carry_position = true;  ///< Each frame but the identity has the position.
  /// Returns the position of a frame; an empty reading without one.
  static Reading reading(const Format& format, const Request& request, const Reply& reply) {
    const bool has_position = request.ask == Ask::position || request.ask == Ask::reset;
    return has_position && format.known() ? to_reading(format, reply) : Reading{};
  }
  /// Returns `sent_at`, the assumed time of the position.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }
  /// Returns the shortest time between two frames.
  static constexpr Time pause(const Format& format) { return format.interface == Interface::spi ? spi_pause : Time{}; }
};

/// The content of successive frames: the position, and cycles of channel 2, one byte per frame.
struct Channels {
  Reading reading{};                      ///< Reading from the last valid frame; empty before the first.
  std::optional<std::uint16_t> status{};  ///< Detailed status in the last valid cycle; no value before it.
  /// Set if the last frame completed a cycle: `none`, or the error of the cycle.
  std::optional<Error> ended{};
  std::uint8_t channel3 = 0;  ///< Channel 3 byte of the last valid cycle.
  bool in_step = false;       ///< Whether the channel 2 bytes are aligned to a cycle.
  /// Whether all bytes of the last cycle were 0, as while the encoder starts.
  bool silent = false;

  /// Processes the valid frame that `host` has received; a cycle with an error ends the alignment.
  void take(const author::HostOf<Frames>& host);

 private:
  ByteBuffer<Format{.multiturn_bits = 16}.cycle_bytes()> bytes_;
  Position first_{};
};

/// Reads a position and, where needed, the identity before it and the alarms behind it.
class ReadPosition : public author::HostOf<Frames> {
 public:
  /// Creates a conversation that reads an encoder of this format.
  explicit ReadPosition(const Format& format);
  [[nodiscard]] const Reading* reading() const final {
    return error() == Error::none && channels_.reading.singleturn_bits != 0 ? &channels_.reading : nullptr;
  }
  /// Returns the content of channels 2 and 3 that was received.
  [[nodiscard]] const Channels& found() const { return channels_; }

 private:
  void concluded(Error error) final;
  void go_on(Ask next) { ask({next}, received_at() + Frames::pause(format())); }

  Channels channels_;
};

}  // namespace absenc::encolink
