// SPDX-License-Identifier: Apache-2.0
// The conversation that only listens.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/encolink/frame.hpp"

namespace absenc::encolink {

/// For encoders that transmit by themselves: sends nothing, finds the frames by their checksums and emits each. Where
/// a frame begins is believed after two good ones in a row. Ends after `count` frames (0: never).
class Listen final : public Conversation<std::uint8_t> {
 public:
  /// `format` must be known: nobody can be asked. Errors: invalid_argument, timeout, bad_checksum.
  explicit Listen(const Format& format, std::uint32_t count = 1);

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override { return detail_; }
  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override;
  /// Bytes that belong to no good frame.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }

 private:
  void byte_received(std::uint8_t byte, Time at);
  void accept(const Position& position, Time at);
  void give_up();

  Format format_;
  std::uint32_t count_;
  std::uint32_t found_ = 0;
  std::uint64_t skipped_ = 0;
  bool in_step_ = false;
  bool emit_pending_ = false;
  bool done_ = false;
  Error last_bad_ = Error::none;
  ByteBuffer<2 * reply_capacity> bytes_;
  ReplyBytes frame_;
  Position position_{};
  Reading reading_{};
  Time deadline_{};
  Time received_at_{};
  Error error_ = Error::none;
  std::string_view detail_{};
};

}  // namespace absenc::encolink
