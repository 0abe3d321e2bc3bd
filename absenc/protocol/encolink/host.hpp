// SPDX-License-Identifier: Apache-2.0
// Host side of EncoLink: frame after frame, and the position that a drive repeats. line.hpp reaches the registers;
// README.md describes both, link/step.hpp how to run a machine.
#pragma once

#include <cstdint>
#include <optional>

#include "absenc/protocol/author/engine.hpp"
#include "absenc/protocol/encolink/channels.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/timing.hpp"

namespace absenc::encolink {

/// Frame after frame, as fast as the encoder answers: positions in channel 1, and cycles of channel 2 once it was asked
/// for. A subclass decides what comes next. What of the format is unknown is asked first.
class Stream : public author::Engine {
 public:
  using Format = encolink::Format;

  /// The latest position: at every `emit`, and at the end.
  [[nodiscard]] const Reading* reading() const override {
    return error() == Error::none && frames_ > 0 ? &reading_ : nullptr;
  }
  [[nodiscard]] const Format& format() const { return format_; }
  /// Of the latest good frame.
  [[nodiscard]] const Position& position() const { return position_; }
  /// Of the latest good cycle; nothing before the first.
  [[nodiscard]] std::optional<std::uint16_t> detailed_status() const { return detailed_status_; }
  /// Good frames so far.
  [[nodiscard]] std::uint32_t frames() const { return frames_; }
  /// Whether the last request was for the identity, or the one before it.
  [[nodiscard]] bool asked_identity() const { return asked_ == Asked::identity || asked_ == Asked::to_identify; }

 protected:
  /// `attempts`: how often a frame is asked for before its error counts.
  Stream(const Format& format, unsigned attempts);
  ~Stream() = default;

  /// Channels 2 and 3 begin anew. The format has channel 2.
  void reset_channels();
  void identify() { identify_pending_ = true; }
  /// What the identity says counts, also against the options.
  void trust_identity() { trusts_identity_ = true; }
  /// The positions cannot be trusted yet.
  void mark_not_ready() { reading_.ready = false; }
  void end(const author::Outcome& outcome);
  [[nodiscard]] bool is_over() const { return over_; }
  /// Whether the bytes of channel 2 are known to be those of a cycle.
  [[nodiscard]] bool in_step() const { return cycle_.in_step(); }
  void lose_step() { cycle_.lose_step(); }

  /// The second byte of the next request.
  virtual std::uint8_t next_ra() { return 0; }
  /// A good position frame came.
  virtual void on_frame() {}
  /// A cycle is complete, or not what it should be.
  virtual void on_cycle(const Result<Cycle>&) {}
  virtual void on_identity(const Identity&) {}
  /// A frame was lost or damaged; it is asked for again.
  virtual void on_damage(Error) {}
  /// No good frame came, as often as it was asked for.
  virtual void on_failure(Error error) { end({.error = error}); }

 private:
  enum class Asked : std::uint8_t { position, reset, to_identify, identity };

  [[nodiscard]] std::size_t expected(Bytes reply) const final;
  [[nodiscard]] Error check(Bytes reply) final;
  // SPI has brought all there is; on a UART more may be coming.
  [[nodiscard]] bool is_whole(Error) const final { return format_.wire == Wire::spi; }
  void answered(Error error) final;
  void woken() final;
  void good_identity();
  void good_position();
  void bad_frame(Error error);
  void follow_channel2();

  Format format_;
  unsigned attempts_;
  unsigned attempts_left_;

  Asked asked_ = Asked::position;
  bool identify_pending_ = false;
  bool trusts_identity_ = false;
  bool uses_channel2_ = false;
  bool reset_pending_ = false;
  bool begun_ = false;
  bool over_ = false;

  CycleReader cycle_;
  std::array<std::uint8_t, request_bytes> request_{};
  // Longer than the longest reply: what no longer fits changes nothing.
  std::array<std::uint8_t, 2 * reply_capacity> storage_;
  Position position_{};
  std::optional<std::uint16_t> detailed_status_;
  Reading reading_{};
  std::uint32_t frames_ = 0;
};

/// One frame. When its position is not valid, near a limit, or all zero as while the encoder starts, a cycle of channel
/// 2 follows: its alarms become those of the reading, and zeros without a channel 2 are not `ready`.
class ReadPosition : public Stream {
 public:
  explicit ReadPosition(const Format& format) : Stream(format, 1) {}
  /// What it finds is told by the unit's own: firmware links no texts.
  void report(FieldSink&) const override {}

 private:
  void on_frame() final;
  void on_cycle(const Result<Cycle>& cycle) final;
  bool looking_closer_ = false;
};

}  // namespace absenc::encolink
