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
  [[nodiscard]] const Reading* reading() const override {
    return error_ == Error::none && found_ > 0 ? &reading_ : nullptr;
  }
  void report(FieldSink& sink) const override;
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override {
    return {{}, frame_.empty() ? bytes_.view() : frame_.view(), received_at_, received_at_};
  }
  /// Bytes that belong to no good frame.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }

 private:
  void byte_received(std::uint8_t byte);
  void drop(std::size_t count);
  void end(Error error, std::string_view detail);

  Format format_;
  std::uint32_t count_;
  std::uint32_t found_ = 0;
  std::uint64_t skipped_ = 0;
  bool in_step_ = false;
  bool emit_pending_ = false;
  bool done_ = false;
  Error last_bad_ = Error::wrong_length;
  ByteBuffer<2 * reply_capacity> bytes_;
  ReplyBytes frame_;  // the last good one
  Position position_{};
  Reading reading_{};
  Time deadline_{};
  Time received_at_{};
  Error error_ = Error::none;
  std::string_view detail_{};
};

}  // namespace absenc::encolink
