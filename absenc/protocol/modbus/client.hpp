// SPDX-License-Identifier: Apache-2.0
// Client side of a Modbus RTU line: one request and its reply at a time, with the silence around frames and changes of
// the baud rate. What the frames say is the subclass's.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/modbus/frame.hpp"
#include "absenc/protocol/modbus/timing.hpp"
#include "absenc/protocol/request_reply.hpp"

namespace absenc::modbus {

class Client : public RequestReply {
 public:
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  [[nodiscard]] std::string_view detail() const final { return explanation_.found; }
  [[nodiscard]] std::string_view advice() const final { return explanation_.advice; }
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final { return {request_, reply_, sent_at_, received_at_}; }

 protected:
  /// `line`: as it is set; `answer_limit`: how long after a request the reply may begin.
  Client(const LineSettings& line, Time answer_limit);
  ~Client() = default;

  /// Sends a request of at most 16 bytes, CRC included, when the line has been silent for `request_silence`, and
  /// for `pause` where that is longer.
  void ask(Bytes request, Time pause = {});
  /// The line is set to `rate` before anything else is sent, and before the end.
  void set_rate(std::uint32_t rate);
  [[nodiscard]] const LineSettings& line() const { return line_; }
  void finish(Error error = Error::none, const Explanation& explanation = {});

  /// How many bytes the reply has that begins so. More when that is not certain: silence then ends it.
  [[nodiscard]] virtual std::size_t expected(Bytes reply) const = 0;
  /// Judges a whole reply.
  [[nodiscard]] virtual Error check(Bytes reply) const = 0;
  /// A reply that passed came. Calls `ask` or `finish`.
  virtual void answered(Bytes reply) = 0;
  /// No such reply came, but `reply`; or the line `is_noisy`. Calls `ask` or `finish`.
  virtual void failed(Error error, Bytes reply) = 0;

 private:
  void received(Bytes bytes) final;
  void conclude() final;

  LineSettings line_;
  Time answer_limit_;
  bool begun_ = false;
  bool setting_rate_ = false;
  ByteBuffer<16> request_;
  FrameBytes reply_;  // what no longer fits changes nothing
  Time pause_{};
  Error error_ = Error::none;
  Explanation explanation_{};
};

}  // namespace absenc::modbus
