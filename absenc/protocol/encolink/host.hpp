// SPDX-License-Identifier: Apache-2.0
// Host side of EncoLink: frames, what one after the other says, and the position that a drive repeats. procedures.hpp
// has all that takes more.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/encolink/frame.hpp"

namespace absenc::encolink {

/// What a frame is asked for.
enum class Ask : std::uint8_t {
  position,
  reset,     // and channels 2 and 3 begin anew in the next frame
  identify,  // the next frame is the identity
  identity,
};

/// author/dialog.hpp says what each of these is.
struct Frames {
  using Format = encolink::Format;
  struct Request {
    Ask ask = Ask::position;
    std::uint8_t ra = 0;  // a byte of a register access
  };
  using Reply = Position;  // of the identity nothing
  static constexpr std::size_t longest_reply = identity_bytes;

  static constexpr author::HostTimes host_times(const Format& format) {
    return {.answer_limit = answer_limit, .gap_limit = gap_limit, .silence = pause(format)};
  }
  static constexpr author::Manner manner(const Format&, const Request&) { return {}; }
  static std::array<std::uint8_t, request_bytes> encode(const Format&, const Request& request);
  static std::size_t expected(const Format& format, const Request& request, Bytes);
  /// Errors: timeout, line_stuck (SPI: all bits alike), those of decode_position or of decode_identity.
  static Result<Position> decode(const Format& format, const Request& request, Bytes reply);
  /// SPI has brought all there is; on a UART more may be coming.
  static bool is_whole(const Format& format, Error) { return format.interface == Interface::spi; }
  /// How long after a frame the next one may begin: also after one of a conversation before this.
  static constexpr Time pause(const Format& format) { return format.interface == Interface::spi ? spi_pause : Time{}; }
};

/// What the frames of a conversation say together: the position, and cycles of channel 2, a byte a frame, from a reset
/// of the channels until a frame is lost.
struct Channels {
  Reading reading{};                      // of the last good frame; nothing before the first
  std::optional<std::uint16_t> status{};  // of the last good cycle
  std::optional<Error> ended{};           // the last frame ended a cycle: none, or what is wrong with it
  std::uint8_t channel3 = 0;              // of the last good cycle
  bool in_step = false;                   // the bytes of channel 2 are those of a cycle
  bool silent = false;                    // all bytes of the last cycle were 0: there is no channel 2 yet

  /// A good frame. A cycle whose position is not that of the frame with which it began is cross_check_failed; one that
  /// is not good ends the step.
  void take(const author::HostOf<Frames>& host);

 private:
  ByteBuffer<Format{.multiturn_bits = 16}.cycle_bytes()> bytes_;
  Position first_{};
};

/// One frame. When its position is not valid, near a limit, or all zero as while the encoder starts, a cycle of channel
/// 2 follows: its alarms become those of the reading. Zeros in both channels are not `ready`; a channel 2 that is wrong
/// otherwise leaves the alarms unknown. What of the format is unknown is asked first.
class ReadPosition : public author::HostOf<Frames> {
 public:
  explicit ReadPosition(const Format& format);
  [[nodiscard]] const Reading* reading() const final {
    return error() == Error::none && channels_.reading.singleturn_bits != 0 ? &channels_.reading : nullptr;
  }
  [[nodiscard]] const Channels& found() const { return channels_; }

 private:
  void concluded(Error error) final;
  void go_on(Ask next) { ask({next}, received_at() + Frames::pause(format())); }

  Channels channels_;
};

}  // namespace absenc::encolink
