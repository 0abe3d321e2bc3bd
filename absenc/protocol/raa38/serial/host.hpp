// SPDX-License-Identifier: Apache-2.0
// What a host does with an RAA38S6 on an asynchronous line beside asking for a position.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/raa38/serial/stream.hpp"

namespace absenc::raa38::serial {

inline constexpr auto fields = author::fields_of<Values>(
    author::field<&Values::encoder_address>("encoder_address", "", "the number behind B", Role::encoder),
    author::field<&Values::clash>("clash", "", "every answer is damaged: two encoders, or a bad line", Role::clash),
    author::field<&Values::before>("before", "counts", "position before the zero was set"),
    author::field<&Values::singleturn>("singleturn", "counts", "position within the turn", Role::position),
    author::field<&Values::second_byte>("second_byte", "", "81, or on a bus Bx: the encoder's number"),
    author::field<&Values::angle>("angle_deg", "deg", "the same as an angle", Role::of_position),
    author::field<&Values::command>("command", "", "read or zero_clear"),
    author::field<&Values::unit>("unit", "", "the number behind B or C"),
    author::field<&Values::skipped>("skipped", "bytes", "so far, that belonged to no good frame"));

/// About a reply to `request`, which may be empty, as to a pulse; with an empty reply about the request, or why none
/// came.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

/// Listens to an encoder that transmits by itself, as long as it is driven. Emits every frame, and every loss of the
/// frames with its error. Ends only when nothing good comes any more: timeout, bad_framing, out_of_range.
class Listen final : public Conversation<std::uint8_t> {
 public:
  explicit Listen(const Format& format);

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] const StreamCounts* stream() const override { return &counts_; }
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override { return words_.detail; }
  [[nodiscard]] std::string_view advice() const override { return words_.advice; }
  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override;

  [[nodiscard]] const StreamDecoder& decoder() const { return decoder_; }

 private:
  // Frames of as many bytes as a port hands out at once.
  static constexpr std::size_t most_waiting = 1024;

  void take(const Found& found);
  [[nodiscard]] Time latched_time(const Found& found) const;
  void give_up();
  void fail(Error error, const Explanation& words);

  Format format_;
  StreamDecoder decoder_;
  Buffer<Found, most_waiting> waiting_;
  std::size_t taken_ = 0;  // of `waiting_`
  bool done_ = false;
  bool heard_ = false;  // anything, since the last good frame
  bool arm_ = true;     // the time to the next good frame begins
  Time deadline_{};
  Time heard_at_{};         // of the bytes that are being worked on,
  Time heard_before_{};     // and of those before
  std::uint64_t good_ = 0;  // frames
  StreamCounts counts_{};
  Reading reading_{};
  FrameBytes frame_;
  Error error_ = Error::none;
  Explanation words_{};
};

using Dialog = author::DialogOf<Protocol>;

/// Reads, sets the zero, and reads until the position is zero. The shaft must stand still. Errors: unsupported and
/// invalid_argument when the settings have no way to do it, or it turns; cross_check_failed when it is not zero after
/// half a second.
author::Procedure set_zero(Dialog& dialog, Values& found);

/// Listens whether somebody transmits unsolicited, then asks every number of a bus, whatever the mode. An answer that
/// is damaged every time tells of two encoders with one number, or of a bad line. Errors: timeout when nobody answers,
/// unexpected_reply when somebody transmits unsolicited.
using Units = std::array<Values, unit_count>;
author::Procedure scan(Dialog& dialog, Units& found);

}  // namespace absenc::raa38::serial
