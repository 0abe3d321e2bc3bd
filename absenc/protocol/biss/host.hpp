// SPDX-License-Identifier: Apache-2.0
// Host side of BiSS-C on a clocked link: the host drives MA and samples SLO.
#pragma once

#include "absenc/protocol/biss/timing.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::biss {

/// How an encoder is clocked.
struct Clocking {
  std::uint32_t rate = line_settings.rate;  // of MA, Hz
  Time latency = 10us;                      // the longest that the encoder needs: makes the number of clocks
};

/// One frame. With BiSS Safety two of them, whose life counters must follow each other (sequence_mismatch).
class ReadPosition final : public Conversation<std::uint8_t> {
 public:
  ReadPosition(const Format& format, const Clocking& clocking);

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override;
  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override;

  /// Of the last good frame.
  [[nodiscard]] const Reply& reply() const { return reply_; }

 private:
  enum class State : std::uint8_t { configure, ready, clocking, done };
  static constexpr std::size_t capacity = 64;

  void received(Bytes bytes);
  void finish(Error error);

  Format format_;
  Clocking clocking_;
  unsigned bits_;
  State state_ = State::configure;
  bool second_ = false;
  Time earliest_{};
  Time sent_at_{};
  Time received_at_{};
  ByteBuffer<capacity> samples_;
  Reply reply_{};
  Reading reading_{};
  Error error_ = Error::none;
};

}  // namespace absenc::biss
