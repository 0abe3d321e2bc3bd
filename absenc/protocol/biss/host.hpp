// SPDX-License-Identifier: Apache-2.0
// Host side of BiSS-C: the host drives MA and samples SLO.
#pragma once

#include <algorithm>
#include <type_traits>
#include <utility>

#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// Longest extra delay of encoder and line, beyond the expected one, for which a host still searches the frame.
inline constexpr Time longest_delay = 80us;

/// A dialog that reads positions and meanwhile carries control frames.
template <class F>
class ControlDialog;

namespace detail {
// Decodes a frame of any format. The call is found by argument-dependent lookup, so that formats can be declared later.
template <class F>
constexpr auto decoded(const F& format, BitView samples, Cds cds = Cds::zero) {
  return decode(format, samples, cds);
}
}  // namespace detail

/// BiSS-C for the engine and the virtual encoder. F: Format, or a format with several words per frame.
template <class F>
struct ProtocolOf {
  /// Format of the encoder: the values of its options.
  using Format = F;
  /// The link has no requests.
  using Request = author::NoRequest;
  /// A reply of the protocol.
  using Reply = std::remove_cvref_t<decltype(*detail::decoded(F{}, BitView{}))>;
  /// Dialog of procedures.
  using Dialog = ControlDialog<F>;
  static constexpr unsigned most_clocks = 512;  ///< Greatest number of clocks of a transfer.

  /// Returns how long a host waits for replies.
  static constexpr author::ClockedHostTimes host_times(const F& format) {
    return {std::uint32_t{format.ma_khz} * 1000, format.timeout.of_host(format.period())};
  }
  /// Returns the number of clocks of a transfer.
  static constexpr unsigned clocks(const F& format) { return biss::clocks(format, format.latency, format.period()); }
  /// Returns the clocks for a frame whose delay is unknown.
  static constexpr unsigned all_clocks(const F& format) {
    return std::min(most_clocks, biss::clocks(format, format.latency + longest_delay, format.period()));
  }
  /// Returns the reply with all checks done, or the first error.
  static constexpr Result<Reply> decode(const F& format, BitView samples) { return detail::decoded(format, samples); }
  /// Returns the position of a reply.
  static constexpr Reading reading(const F& format, const Reply& reply) { return reading_of(format, reply); }
};
/// The protocol of one word.
using Protocol = ProtocolOf<Format>;

/// Returns the life counter, which must advance with each frame; -1 if the frames have none.
[[nodiscard]] constexpr int life_counter_of(const Format& format, const Reply& reply) {
  return format.check.life_counter ? reply.life_counter : -1;
}
/// Returns the life counter of a reply, or -1 if it has none.
template <const Format& format>
[[nodiscard]] constexpr int life_counter_of(const KnownFormat<format>&, const ReplyTo<format>& reply) {
  return format.check.life_counter ? reply.life_counter : -1;
}

/// Confirms frames that begin later than expected: accepts a delay that occurs twice in a row. A lost start bit also
/// makes a frame look late, and its CRC is valid once in 64 times.
class LateFrames {
 public:
  /// Returns whether the last frame had the same delay. `head`: clocks before the start bit beyond the idle ones; a
  /// difference of one is accepted, because the delay may be near a whole clock.
  [[nodiscard]] bool is_again(unsigned head) {
    const unsigned before = std::exchange(seen_, head);
    return before != 0 && head + 1 - before <= 2;
  }

 private:
  unsigned seen_ = 0;
};

/// Decides when to send the start sequence. After power on, an encoder may stay idle until it receives two pulses of
/// MA, with 40 us before and after them. A host does not know when that was: it sends them once, if the first frame is
/// stuck.
class StartSequence {
 public:
  /// Takes the result of a frame and returns whether the start sequence must follow.
  [[nodiscard]] bool is_due(Error error) {
    given_ = std::exchange(first_, false) && error == Error::line_stuck;
    return given_;
  }
  /// Returns whether the last transfer was the start sequence, so that the frame must be clocked again.
  [[nodiscard]] bool was_given() { return std::exchange(given_, false); }

 private:
  bool first_ = true;
  bool given_ = false;
};

/// Reads one frame; with life counters two, which must follow each other (sequence_mismatch). If `finds`, also searches
/// a frame that is later than expected, and sends the start sequence if needed.
template <class F, bool finds>
class PositionReader : public author::ClockedHostOf<ProtocolOf<F>> {
  using Base = author::ClockedHostOf<ProtocolOf<F>>;
  using P = ProtocolOf<F>;
  static constexpr unsigned most_late = 4;  // late frames that are read until two of them agree

 public:
  /// Reads positions from an encoder of this format.
  explicit PositionReader(const F& format) : Base(format) {}

 private:
  void clocked(BitView samples) final {
    if constexpr (finds) {
      if (start_.was_given()) return this->ask();
    }
    const int before = life_counter_of(this->format(), this->last());
    const Error error = this->take(samples);
    if constexpr (finds) {
      if (start_.is_due(error)) return this->clock(start_pulses);
      // A line that stays idle may have a longer delay than expected: the host clocks once for the longest delay.
      if (error == Error::line_stuck && samples[0] && !second_ && !tried_longest_delay_) {
        tried_longest_delay_ = true;
        return this->clock(P::all_clocks(this->format()));
      }
      const unsigned head = this->last().delay_bits + this->last().ack_bits;
      const bool expected =
          tries_ == 0 && head <= head_bits(this->format(), this->format().latency, this->format().period());
      const bool late = error == Error::none ? !expected && !late_.is_again(head) : ended_early(error, samples);
      if (late && tries_++ < most_late) return this->clock(P::all_clocks(this->format()));
      if (late) return this->conclude(Error::truncated);
    }
    if (error != Error::none || before < 0) return this->conclude(error);
    const int now = life_counter_of(this->format(), this->last());
    if (second_) {
      const bool follows = now == static_cast<int>((static_cast<unsigned>(before) + 1) & low_mask(life_counter_bits));
      return this->conclude(follows ? Error::none : Error::sequence_mismatch);
    }
    second_ = true;
    this->clock(tries_ != 0 ? P::all_clocks(this->format()) : P::clocks(this->format()));
  }

  bool second_ = false;
  bool tried_longest_delay_ = false;
  std::uint8_t tries_ = 0;
  [[no_unique_address]] std::conditional_t<finds, LateFrames, author::Later> late_{};
  [[no_unique_address]] std::conditional_t<finds, StartSequence, author::NoRequest> start_{};
};
/// Reads the position of a known line; a drive polls with it.
using ReadPosition = PositionReader<Format, false>;
/// Reads the position with a format that is known at compile time: `static constexpr Format format{...};`.
template <const Format& format>
class ReadKnownPosition final : public PositionReader<KnownFormat<format>, false> {
 public:
  ReadKnownPosition() : PositionReader<KnownFormat<format>, false>({}) {}
};
/// Reads a frame that may be later than expected, as the first one is.
template <class F>
using FindPosition = PositionReader<F, true>;

}  // namespace absenc::biss
