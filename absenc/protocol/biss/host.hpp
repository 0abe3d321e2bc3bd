// SPDX-License-Identifier: Apache-2.0
// Host side of BiSS-C: the host drives the clock MA, samples SLO and decodes the position.
#pragma once

#include <algorithm>
#include <type_traits>
#include <utility>

#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// Greatest time by which the delay of encoder and line may exceed the format's `latency` so that a host still finds
/// the start bit.
inline constexpr Time longest_delay = 80us;

/// A conversation that reads positions and carries control frames; dialog.hpp defines it.
template <class F>
class ControlDialog;

namespace detail {
// Argument-dependent lookup finds `decode`, so that formats can be declared later.
template <class F>
constexpr auto decoded(const F& format, const BitView& samples, Cds cds = Cds::zero) {
  return decode(format, samples, cds);
}
}  // namespace detail

/// BiSS-C as the classes of author/ use it: types, times and decoding.
template <class F>
struct ProtocolOf {
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = F;
  /// C++ type of requests, which is empty: on a clocked link the host sends no requests.
  using Request = author::NoRequest;
  /// C++ type of a decoded frame.
  using Reply = std::remove_cvref_t<decltype(*detail::decoded(F{}, BitView{}))>;
  /// Interface by which procedures clock frames.
  using Dialog = ControlDialog<F>;
  static constexpr unsigned most_clocks = 512;          ///< Greatest number of clocks in one transfer.
  static constexpr bool replies_carry_position = true;  ///< Frames carry the position, also during control frames.

  /// Returns the rate of MA and the pause before each frame.
  static constexpr author::ClockedHostTimes host_times(const F& format) {
    return {std::uint32_t{format.ma_khz} * 1000, format.timeout.of_host(format.period())};
  }
  /// Returns the number of clocks of a frame whose delay of encoder and line is the format's `latency`.
  static constexpr unsigned clocks(const F& format) { return biss::clocks(format, format.latency, format.period()); }
  /// Returns the number of clocks, at most `most_clocks`, of a frame whose delay of encoder and line is longer than the
  /// format's `latency` by `longest_delay`.
  static constexpr unsigned all_clocks(const F& format) {
    return std::min(most_clocks, biss::clocks(format, format.latency + longest_delay, format.period()));
  }
  /// Decodes a frame whose CDS must be 0. `AnyFormat`: F, or F compiled.
  template <class AnyFormat>
  static constexpr Result<Reply> decode(const AnyFormat& format, const BitView& samples) {
    return detail::decoded(format, samples);
  }
  /// Converts a reply to a reading.
  static constexpr Reading reading(const F& format, const Reply& reply) { return reading_of(format, reply); }
};
/// BiSS-C with one position word.
using Protocol = ProtocolOf<Format>;

/// Returns the life counter of a reply, or -1 if the check has none.
[[nodiscard]] constexpr int life_counter_of(const Format& format, const Reply& reply) {
  return format.check.life_counter ? reply.life_counter : -1;
}
/// Returns the life counter of a reply, or -1 if the check has none.
template <const Format& format>
[[nodiscard]] constexpr int life_counter_of(const KnownFormat<format>&, const ReplyTo<format>& reply) {
  return format.check.life_counter ? reply.life_counter : -1;
}

/// Confirms late frames: a single late frame may have lost its start bit, so the next frame must be as late.
class LateFrames {
 public:
  /// Returns whether the delay `head`, in clocks, differs by at most one from that of the previous call; first call:
  /// false.
  [[nodiscard]] bool is_again(unsigned head) {
    const unsigned before = std::exchange(seen_, head);
    return before != 0 && head + 1 - before <= 2;
  }

 private:
  unsigned seen_ = 0;
};

/// Decides whether the start sequence is sent: once, if the line is stuck in the first frame.
class StartSequence {
 public:
  /// Processes the error of a frame and returns whether the start sequence must be sent next.
  [[nodiscard]] bool is_due(Error error) {
    given_ = std::exchange(first_, false) && error == Error::line_stuck;
    return given_;
  }
  /// Returns whether the last transfer was the start sequence, and resets this state.
  [[nodiscard]] bool was_given() { return std::exchange(given_, false); }

 private:
  bool first_ = true;
  bool given_ = false;
};

/// Reads a position; if `finds`, also from a frame that is later than expected.
template <class F, bool finds>
class PositionReader : public author::ClockedHostOf<ProtocolOf<F>> {
  using Base = author::ClockedHostOf<ProtocolOf<F>>;
  using P = ProtocolOf<F>;
  // greatest number of times that the host reads again after a frame that was late or cut off
  static constexpr unsigned most_late = 4;

 public:
  /// Creates a conversation that reads an encoder of this format.
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
      // If SLO stays idle in all samples, the delay of encoder and line may be longer than expected.
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
/// Reads the position from a line with a known delay; a drive polls with this conversation.
using ReadPosition = PositionReader<Format, false>;
/// Reads the position with a format that is known at compile time.
template <const Format& format>
class ReadKnownPosition final : public PositionReader<KnownFormat<format>, false> {
 public:
  ReadKnownPosition() : PositionReader<KnownFormat<format>, false>({}) {}
};
/// Reads the position from a line whose delay may be longer than expected.
template <class F>
using FindPosition = PositionReader<F, true>;

}  // namespace absenc::biss
