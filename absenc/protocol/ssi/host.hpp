// SPDX-License-Identifier: Apache-2.0
// Host side of SSI: times, and conversations that read one word or two.
#pragma once

#include <algorithm>

#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/ssi/frame.hpp"

namespace absenc::ssi {

/// SSI as the classes of protocol/author use it: word, clocks and times.
struct Protocol {
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = ssi::Format;
  /// C++ type of requests, which is empty: a host of SSI encoders sends no requests.
  using Request = author::NoRequest;
  /// C++ type of the decoded word.
  using Reply = Word;
  static constexpr unsigned most_clocks = frame_capacity;  ///< Greatest number of clocks in one transfer.

  /// Returns the pause of the clock before each word.
  static constexpr author::ClockedHostTimes host_times(const Format& format) {
    return {.rest = format.pause + pause_margin};
  }
  /// Returns the number of clocks of one reading.
  static constexpr unsigned clocks(const Format& format) { return ssi::clocks(format); }
  /// Decodes a reply with all checks. `AnyFormat`: Format or Format::Compiled.
  template <class AnyFormat>
  static constexpr Result<Word> decode(const AnyFormat& format, const BitView& bits) {
    return ssi::decode(format, bits);
  }
  /// Converts a reply to a reading.
  static constexpr Reading reading(const Format& format, const Word& word) {
    WordContents contents = contents_of(format.word);
    if (format.error_parity) contents.reported |= word_error;
    return to_reading(contents, word, format.scale);
  }
};

/// Returns whether a shaft with at most `confirm_rpm` can have moved from `before` to `after` in the time `between`.
[[nodiscard]] constexpr bool can_follow(const Format& format, const Word& before, const Word& after, Time between) {
  const unsigned bits = format.word.bits_of(Meaning::position);
  const unsigned turns = format.word.bits_of(Meaning::multiturn);
  const std::uint64_t mask = low_mask(bits + turns);
  const std::uint64_t difference =
      ((after.multiturn << bits | after.position) - (before.multiturn << bits | before.position));
  const std::uint64_t counts = std::min(difference & mask, (~difference + 1) & mask);
  // Distance in 2^-32 of a turn: at 60 rpm the shaft moves 4295 per microsecond.
  const auto distance = static_cast<std::uint64_t>(between.count()) / 1000 * format.confirm_rpm / 60 * 4295 + 1;
  const std::uint64_t reach = bits >= 32 ? distance << (bits - 32) : distance >> (32 - bits);
  return counts <= reach + 1;
}

/// Reads one word, and after it the number of bits that `format.extra_clocks` states.
using ReadPosition = author::ReadClocked<Protocol>;

/// Reads two words and reports the second. Further error: cross_check_failed.
class ConfirmPosition : public author::ClockedHostOf<Protocol> {
 public:
  /// Creates a conversation that reads an encoder of this format twice.
  explicit ConfirmPosition(const Format& format) : ClockedHostOf(format) {}

 private:
  void clocked(BitView bits) final {
    const Word before = last();
    const Time before_at = first_at_;
    const Error error = take(bits);
    if (error != Error::none) return conclude(error);
    if (second_) {
      return conclude(can_follow(format(), before, last(), begun_at() - before_at) ? Error::none
                                                                                   : Error::cross_check_failed);
    }
    second_ = true;
    first_at_ = begun_at();
    ask();
  }

  Time first_at_{};
  bool second_ = false;
};

}  // namespace absenc::ssi
