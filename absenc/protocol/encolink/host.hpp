// SPDX-License-Identifier: Apache-2.0
// Host side of EncoLink: one stream machine, and the conversations that need no registers.
// procedures.hpp has those that do; README.md describes both, link/step.hpp how to run a machine.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/encolink/channels.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/timing.hpp"
#include "absenc/protocol/request_reply.hpp"

namespace absenc::encolink {

/// A transfer on SPI brings the frame of the moment at which it begins; a UART answers afterwards.
enum class Wire : std::uint8_t { uart, spi };

/// Frame after frame, as fast as the encoder answers: positions in channel 1, cycles of channel 2 once it was asked
/// for, and one register access at a time in channel 3. A subclass decides what comes next. What of the format is
/// unknown is asked first.
class Stream : public RequestReply {
 public:
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  [[nodiscard]] std::string_view detail() const final { return detail_; }
  [[nodiscard]] std::string_view advice() const final { return noise_explanation().advice; }
  /// The latest position: at every `emit`, and at the end.
  [[nodiscard]] const Reading* reading() const override;
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final;

  [[nodiscard]] const Format& format() const { return format_; }
  /// Of the latest good frame.
  [[nodiscard]] const Position& position() const { return position_; }
  /// Of the latest good cycle; nothing before the first.
  [[nodiscard]] std::optional<std::uint16_t> detailed_status() const { return detailed_status_; }
  /// Good frames so far.
  [[nodiscard]] std::uint32_t frames() const { return frames_; }

 protected:
  /// `attempts`: how often a frame is asked for before its error counts.
  Stream(const Format& format, Wire wire, unsigned attempts);
  ~Stream() = default;

  /// Channels 2 and 3 begin anew.
  void reset_channels();
  /// Begins an access as soon as channel 3 is free; the channels are reset for it when they have to be. The identity is
  /// asked first: an encoder with other registers is `unsupported`.
  void submit(const RegisterRequest& request);
  void identify();
  /// What the identity says counts, also against the options.
  void trust_identity() { trusts_identity_ = true; }
  /// Whether every good frame is emitted.
  void emit_frames(bool emits) { emits_frames_ = emits; }
  void emit_once() { emit_pending_ = true; }
  /// The positions cannot be trusted yet.
  void mark_not_ready() { reading_.ready = false; }
  void finish(Error error = Error::none, std::string_view detail = {});

  /// A good position frame came.
  virtual void on_frame() {}
  /// A cycle is complete, or not what it should be.
  virtual void on_cycle(Error) {}
  /// The access is over: with `none` the encoder executed it. Calls submit or finish.
  virtual void on_access(Error error, std::string_view detail) { finish(error, detail); }
  virtual void on_identity(const Identity&) {}
  /// No good frame came, as often as it was asked for.
  virtual void on_failure(Error error, std::string_view detail) { finish(error, detail); }

  [[nodiscard]] const RegisterAccess& access() const { return access_; }
  [[nodiscard]] bool is_done() const { return state_ == State::done; }

 private:
  enum class Asked : std::uint8_t { position, reset, to_identify, identity };

  void begin_frame(Time now);
  void received(Bytes bytes) final;
  void conclude() final;
  [[nodiscard]] Error check();
  void good_frame();
  void good_position();
  void good_identity();
  void bad_frame(Error error);
  void follow_channel2();
  void follow_access();
  void end_access(Error error, std::string_view detail = {});
  void try_access_again(Error error, std::string_view detail);
  [[nodiscard]] std::string_view describe(Error error) const;
  [[nodiscard]] bool is_stuck() const;
  [[nodiscard]] std::size_t expected() const;

  Format format_;
  Wire wire_;
  unsigned attempts_;
  unsigned frame_attempts_left_;
  unsigned access_attempts_left_ = 0;

  Asked asked_ = Asked::position;
  bool identify_pending_ = false;
  bool trusts_identity_ = false;
  std::uint8_t protocol_version_ = 0;  // 0: not asked yet
  bool uses_channel2_ = false;
  bool reset_pending_ = false;
  bool emits_frames_ = false;
  bool emit_pending_ = false;

  CycleReader cycle_;
  RegisterAccess access_;

  std::array<std::uint8_t, request_bytes> request_{};
  // Longer than the longest reply: what no longer fits changes nothing.
  ByteBuffer<2 * reply_capacity> reply_;
  Position position_{};
  Identity identity_{};
  std::optional<std::uint16_t> detailed_status_;
  Reading reading_{};
  std::uint32_t frames_ = 0;
  Time earliest_{};
  Time began_at_{};
  Error error_ = Error::none;
  std::string_view detail_{};
};

/// One frame. When its position is not valid, near a limit, or all zero as while the encoder starts, a cycle of channel
/// 2 follows: its alarms become those of the reading, and zeros without a channel 2 are not `ready`.
class ReadPosition final : public Stream {
 public:
  explicit ReadPosition(const Format& format, Wire wire = Wire::uart) : Stream(format, wire, 1) {}
  void report(FieldSink& sink) const override;

 private:
  void on_frame() override;
  void on_cycle(Error error) override;
  bool looking_closer_ = false;
};

/// A full cycle of channel 2, checked against channel 1.
class ReadDetailedStatus final : public Stream {
 public:
  explicit ReadDetailedStatus(const Format& format, Wire wire = Wire::uart);
  void report(FieldSink& sink) const override;

 private:
  void on_cycle(Error error) override;
  unsigned attempts_left_;
};

/// Asks for the identity; the format need not be known.
class Identify final : public Stream {
 public:
  explicit Identify(const Format& format, Wire wire = Wire::uart);
  [[nodiscard]] const Identity& identity() const { return identity_; }
  [[nodiscard]] const Reading* reading() const override { return nullptr; }
  void report(FieldSink& sink) const override;

 private:
  void on_identity(const Identity& identity) override;
  Identity identity_{};
};

}  // namespace absenc::encolink
