// SPDX-License-Identifier: Apache-2.0
// Host side of BiSS-C: the host drives MA and samples SLO.
#pragma once

#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// BiSS-C as the engine and the virtual encoder use it.
struct Protocol {
  using Format = biss::Format;
  using Request = author::NoRequest;
  using Reply = biss::Reply;
  static constexpr unsigned most_clocks = 512;

  static constexpr author::ClockedHostTimes host_times(const Format& format) {
    return {format.ma_khz * 1000, timeout_maximum};
  }
  static constexpr unsigned clocks(const Format& format) {
    return biss::clocks(format, format.latency, format.period());
  }
  static constexpr Result<Reply> decode(const Format& format, BitView samples) { return biss::decode(format, samples); }
  static constexpr Reading reading(const Format& format, const Reply& reply) {
    return to_reading(format.word, reply.word, format.scale);
  }
};

/// One frame. With BiSS Safety two of them, whose life counters must follow each other (sequence_mismatch).
class ReadPosition : public author::ClockedHostOf<Protocol> {
 public:
  explicit ReadPosition(const Format& format) : ClockedHostOf(format) {}

 private:
  void clocked(BitView samples) final;

  bool second_ = false;
};

}  // namespace absenc::biss
