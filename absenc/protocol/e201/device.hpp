// SPDX-License-Identifier: Apache-2.0
// A virtual E201-9S interface with a BiSS or SSI encoder behind it. It never streams: `1` returns one position.
#pragma once

#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/e201/frame.hpp"

namespace absenc::e201 {

/// A virtual E201-9S interface with an encoder behind it.
class VirtualInterface final : public author::Responder {
 public:
  /// Creates an interface that is off until `power_on`. `shaft` must outlive it.
  VirtualInterface(const Format& format, const Shaft& shaft);

  [[nodiscard]] MutableBytes memory() override { return {}; }

 private:
  [[nodiscard]] std::size_t request_size(Bytes begin) const override;
  [[nodiscard]] std::size_t others_reply_size(Bytes) const override { return 0; }
  Answer respond(Bytes request, Time at, ByteBuffer<64>& reply) override;
  void started(Time) override { encoder_.set_power(true); }
  void stopped(Time) override;

  Answer answer_samples(Time at, ByteBuffer<64>& reply);
  bool change(const Request& request, Time at);
  [[nodiscard]] std::uint64_t counts(Time at) const;
  [[nodiscard]] std::uint64_t samples(Time at, Time period);

  Format format_;
  const Shaft* shaft_;
  // BiSS encoder behind the interface; in place of an SSI encoder, this object only stores whether the supply is on
  biss::Encoder encoder_;
  unsigned clock_ = 4;  // number of the MA clock, 1 to 8; 4 is 280 kHz
  unsigned width_;      // width of the position in bits, which `b` returns
  std::uint64_t zero_ = 0;
};

}  // namespace absenc::e201
