// SPDX-License-Identifier: Apache-2.0
// The conversation that only receives, for EncoLink encoders that transmit without requests.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/discarded.hpp"
#include "absenc/protocol/encolink/frame.hpp"

namespace absenc::encolink {

/// Conversation that sends nothing and receives the frames of a streaming encoder, which it finds by their checksums.
class Listen final : public Conversation<std::uint8_t> {
 public:
  /// Creates a conversation for an encoder of this format, whose resolution and turns must be known.
  explicit Listen(const Format& format);

  /// Processes received data or a damaged character; ignores other events.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns what the port must do next: wait, deliver a result, or end.
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] const StreamCounts* stream() const override { return &counts_; }
  [[nodiscard]] Error error() const override { return error_; }
  [[nodiscard]] std::string_view detail() const override { return detail_; }
  [[nodiscard]] const Reading* reading() const override {
    return error_ == Error::none && !frame_.empty() ? &reading_ : nullptr;
  }
  void report(FieldSink& sink) const override;
  /// Returns the bytes of the last frame, valid or damaged; if there is none, the received bytes that were not examined
  /// yet.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override {
    return {{}, frame_.empty() ? waiting() : frame_.view(), received_at_, received_at_};
  }
  /// Returns the number of received bytes that belong to no valid frame.
  [[nodiscard]] std::uint64_t skipped() const { return discarded_.skipped(); }

 private:
  [[nodiscard]] Bytes waiting() const { return Bytes(bytes_).subspan(begin_, end_ - begin_); }
  bool find();
  void take(Bytes frame, const Position& position);
  void lose(Error error, Bytes frame);
  void end(Error error, std::string_view detail);

  Format format_;
  DiscardedFrames discarded_;
  StreamCounts counts_{};
  bool in_step_ = false;
  // whether a damaged character was received while the host knew where frames begin
  bool disturbed_ = false;
  bool received_anything_ = false;  // whether bytes or damaged characters were received since the last valid frame
  bool done_ = false;
  Error last_bad_ = Error::wrong_length;
  std::array<std::uint8_t, 1024> bytes_{};  // received bytes; bytes that find no room are counted as skipped
  std::size_t begin_ = 0;                   // index of the first byte that was not examined yet
  std::size_t end_ = 0;
  ReplyBytes frame_;  // last frame that was received, valid or damaged
  Position position_{};
  Reading reading_{};
  Time deadline_{};
  Time received_at_{};
  Error error_ = Error::none;
  std::string_view detail_{};
};

}  // namespace absenc::encolink
