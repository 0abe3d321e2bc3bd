// SPDX-License-Identifier: Apache-2.0
// Host side of SSI on a clocked link.
#pragma once

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/ssi/frame.hpp"
#include "absenc/protocol/ssi/timing.hpp"

namespace absenc::ssi {

/// One word, and the bits behind it that `format.extra_clocks` asks for.
class ReadPosition final : public Conversation<std::uint8_t> {
 public:
  /// `pause`: Tm of the encoder.
  explicit ReadPosition(const Format& format, Time pause = Timing{}.pause);

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override;
  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override;

  [[nodiscard]] const Word& word() const { return word_; }

 private:
  enum class State : std::uint8_t { ready, clocking, done };

  void received(Bytes bytes);
  void finish(Error error);

  Format format_;
  Time pause_;
  State state_ = State::ready;
  Time clocked_at_{};
  Time sent_at_{};
  Time received_at_{};
  ByteBuffer<frame_capacity / 8> bits_;
  Word word_{};
  Reading reading_{};
  Error error_ = Error::none;
};

}  // namespace absenc::ssi
