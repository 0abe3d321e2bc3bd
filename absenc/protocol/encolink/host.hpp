// SPDX-License-Identifier: Apache-2.0
// Host side of EncoLink: requests for one frame, and the channels that successive frames carry.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/encolink/frame.hpp"

namespace absenc::encolink {

/// Purpose of a request. The reply to each request but `identity` has a position.
enum class Ask : std::uint8_t {
  position,
  reset,     ///< Requests a position, and that channels 2 and 3 restart in the next frame.
  identify,  ///< Requests a position, and that the next frame is the identity.
  identity,
};

/// Types and functions of the protocol that author/dialog.hpp requires.
struct Frames {
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = encolink::Format;
  /// A request to the encoder.
  struct Request {
    Ask ask = Ask::position;  ///< Purpose of the request.
    std::uint8_t ra = 0;      ///< Second byte of the request: one byte of a register access, or 0.
  };
  /// C++ type of the replies: a position, which is empty in the replies to `identify` and `identity`.
  using Reply = Position;
  /// Number of bytes of the longest reply, an identity; one more byte may follow it.
  static constexpr std::size_t longest_reply = identity_bytes;

  /// Returns the host's timeouts, and the silence before a request.
  static constexpr author::HostTimes host_times(const Format& format) {
    return {.answer_limit = answer_limit, .gap_limit = gap_limit, .silence = pause(format)};
  }
  /// Returns how a host sends a request.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    // the request after `identify` must be the one that reads the identity
    return {.holds_line = request.ask == Ask::identify};
  }
  /// Returns the bytes of `request` as they are sent.
  static std::array<std::uint8_t, request_bytes> encode(const Format&, const Request& request);
  /// Returns the length of the reply to `request` in bytes; 0 if only silence ends the reply.
  static std::size_t expected(const Format& format, const Request& request, Bytes);
  /// Decodes a reply. The reply to `identify` is checked, but its content is ignored.
  static Result<Position> decode(const Format& format, const Request& request, Bytes reply);
  /// Returns whether a reply with an error is complete: on SPI it is, because a transfer has a fixed length.
  static bool is_whole(const Format& format, Error) { return format.interface == Interface::spi; }
  /// Marks that replies carry a position; only the identity carries none.
  static constexpr bool replies_carry_position = true;
  /// Returns the position of a reply as a reading; an empty reading if the reply has no position.
  static Reading reading(const Format& format, const Request& request, const Reply& reply) {
    const bool has_position = request.ask == Ask::position || request.ask == Ask::reset;
    return has_position && format.known() ? to_reading(format, reply) : Reading{};
  }
  /// Returns `sent_at`, the end of the request, as the time of the position; no document states that time.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }
  /// Returns the pause that a host keeps between two frames.
  static constexpr Time pause(const Format& format) { return format.interface == Interface::spi ? spi_pause : Time{}; }
};

/// The content of successive frames: the position, and cycles of channel 2, one byte per frame.
struct Channels {
  Reading reading{};  ///< Reading from the last valid frame; empty before the first valid frame.
  /// Detailed status in the last valid cycle of channel 2; no value before the first valid cycle.
  std::optional<std::uint16_t> status{};
  /// Set if the last frame completed a cycle of channel 2: `none`, or the error of the cycle.
  std::optional<Error> ended{};
  std::uint8_t channel3 = 0;  ///< Channel 3 byte of the last valid cycle of channel 2.
  bool in_step = false;       ///< Whether the host knows which byte of its cycle each channel 2 byte is.
  /// Whether all bytes of the last cycle of channel 2 were 0, as while the encoder starts.
  bool silent = false;

  /// Processes the valid frame that `host` has received. If a cycle of channel 2 ends with an error, `in_step` becomes
  /// false.
  void take(const author::HostOf<Frames>& host);

 private:
  ByteBuffer<Format{.multiturn_bits = 16}.cycle_bytes()> bytes_;
  Position first_{};
};

/// Reads a position. Reads the identity first if the format is not known, and a cycle of channel 2 after it if alarms
/// are needed.
class ReadPosition : public author::HostOf<Frames> {
 public:
  /// Creates a conversation that reads an encoder of this format.
  explicit ReadPosition(const Format& format);
  [[nodiscard]] const Reading* reading() const final {
    return error() == Error::none && channels_.reading.singleturn_bits != 0 ? &channels_.reading : nullptr;
  }
  /// Returns the content of channels 2 and 3 that was received so far.
  [[nodiscard]] const Channels& found() const { return channels_; }

 private:
  void concluded(Error error) final;
  void go_on(Ask next) { ask({next}, received_at() + Frames::pause(format())); }

  Channels channels_;
};

}  // namespace absenc::encolink
