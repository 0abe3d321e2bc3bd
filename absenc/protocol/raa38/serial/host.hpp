// SPDX-License-Identifier: Apache-2.0
// Host procedures of an RAA38S6 on an asynchronous line, and reception of its stream.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/raa38/serial/stream.hpp"

namespace absenc::raa38::serial {

/// Fields in which the members of Values are reported.
inline constexpr auto fields = author::fields_of<Values>(
    author::field<&Values::encoder_address>("encoder_address", "", "the number behind B", Role::encoder),
    author::field<&Values::clash>("clash", "", "every answer is damaged: two encoders, or a bad line", Role::clash),
    author::field<&Values::before>("before", "counts", "position before the zero was set"),
    author::field<&Values::singleturn>("singleturn", "counts", "position within the turn", Role::position),
    author::field<&Values::second_byte>("second_byte", "", "81, or on a bus Bx: the encoder's number"),
    author::field<&Values::angle>("angle_deg", "deg", "the same as an angle", Role::of_position),
    author::field<&Values::command>("command", "", "read or zero_clear"),
    author::field<&Values::unit>("unit", "", "the number behind B or C"),
    author::field<&Values::skipped>("skipped", "bytes", "received so far that belong to no valid frame"));

/// Returns cause and advice for an error of `request` or `reply`; either may be empty.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

/// Receives the frames of a streaming encoder and sends nothing. Emits valid frames and losses of alignment. Errors at
/// the end: timeout, bad_framing, out_of_range.
class Listen final : public Conversation<std::uint8_t> {
 public:
  /// Creates a conversation that receives the stream of an encoder of this format.
  explicit Listen(const Format& format);

  /// Processes an event of the port, such as received data or silence.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns what the port must do next, such as send or wait.
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] const StreamCounts* stream() const override { return &counts_; }
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override { return words_.detail; }
  [[nodiscard]] std::string_view advice() const override { return words_.advice; }
  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  /// Returns an exchange that consists of the last emitted frame, which may be empty, and no request.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override;

  /// Returns the decoder that finds the frames in the stream.
  [[nodiscard]] const StreamDecoder& decoder() const { return decoder_; }

 private:
  // Greatest number of stream results that wait to be emitted; it suffices for the bytes that a port delivers at once.
  static constexpr std::size_t most_waiting = 1024;

  void take(const StreamFrame& found);
  [[nodiscard]] Time latched_time(const StreamFrame& found) const;
  void end_stream();
  void fail(Error error, const Explanation& words);

  Format format_;
  StreamDecoder decoder_;
  Buffer<StreamFrame, most_waiting> waiting_;
  std::size_t taken_ = 0;
  bool done_ = false;
  bool received_anything_ = false;  // whether any bytes were received since the last valid frame was emitted
  bool restart_timeout_ = true;     // whether the next call of `next` restarts the timeout of the stream
  Time deadline_{};
  Time received_at_{};  // time at which the bytes that are being processed were received
  // time at which the preceding bytes were received; for the first bytes equal to `received_at_`
  Time received_before_{};
  std::uint64_t valid_count_ = 0;  // number of valid frames emitted so far
  StreamCounts counts_{};
  Reading reading_{};
  FrameBytes frame_;
  Error error_ = Error::none;
  Explanation words_{};
};

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

/// Reads the position, sets the zero, and polls the position until it is zero or a time is over. Errors: unsupported,
/// invalid_argument, not_still, cross_check_failed, or those of reading the position.
author::Procedure set_zero(Dialog& dialog, Values& found);

/// Result of a scan of a bus for encoders; the index is the number of the encoder.
using Units = std::array<Values, unit_count>;
/// Scans the bus for encoders. Errors: timeout, unexpected_reply, or that of an exchange.
author::Procedure scan(Dialog& dialog, Units& found);

}  // namespace absenc::raa38::serial
