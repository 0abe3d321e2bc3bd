// SPDX-License-Identifier: Apache-2.0
// Host side of SSI.
#pragma once

#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/ssi/frame.hpp"

namespace absenc::ssi {

/// SSI as the engine uses it. The port has the rate of the clock already.
struct Protocol {
  using Format = ssi::Format;
  using Request = author::NoRequest;
  using Reply = Word;
  static constexpr unsigned most_clocks = frame_capacity;

  static constexpr author::ClockedHostTimes host_times(const Format& format) {
    return {.rest = format.pause + pause_margin};
  }
  static constexpr unsigned clocks(const Format& format) { return ssi::clocks(format); }
  static constexpr Result<Word> decode(const Format& format, BitView bits) { return ssi::decode(format, bits); }
  static constexpr Reading reading(const Format& format, const Word& word) {
    return to_reading(format.word, word, format.scale);
  }
};

/// One word, and the bits behind it that `format.extra_clocks` asks for.
using ReadPosition = author::ReadClocked<Protocol>;

}  // namespace absenc::ssi
