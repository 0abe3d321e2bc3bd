// SPDX-License-Identifier: Apache-2.0
// Host side of BiSS-C: the host drives MA and samples SLO.
#pragma once

#include <algorithm>
#include <type_traits>
#include <utility>

#include "absenc/protocol/author/clocked_host.hpp"
#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// The longest that an encoder may be busy, and the longest delay of its line: how much more than was thought a host
/// looks for the frame.
inline constexpr Time longest_delay = 80us;

template <class F>
class ControlDialog;

namespace detail {
// Of any format: what is declared behind this file is found by its namespace.
template <class F>
constexpr auto decoded(const F& format, BitView samples, Cds cds = Cds::zero) {
  return decode(format, samples, cds);
}
}  // namespace detail

/// BiSS-C as the engine and the virtual encoder use it. F: Format, or what describes several words in a frame.
template <class F>
struct ProtocolOf {
  using Format = F;
  using Request = author::NoRequest;
  using Reply = std::remove_cvref_t<decltype(*detail::decoded(F{}, BitView{}))>;
  using Dialog = ControlDialog<F>;
  static constexpr unsigned most_clocks = 512;

  static constexpr author::ClockedHostTimes host_times(const F& format) {
    return {std::uint32_t{format.ma_khz} * 1000, format.timeout.of_host(format.period())};
  }
  static constexpr unsigned clocks(const F& format) { return biss::clocks(format, format.latency, format.period()); }
  /// Of a frame whose delay is not known.
  static constexpr unsigned all_clocks(const F& format) {
    return std::min(most_clocks, biss::clocks(format, format.latency + longest_delay, format.period()));
  }
  static constexpr Result<Reply> decode(const F& format, BitView samples) { return detail::decoded(format, samples); }
  static constexpr Reading reading(const F& format, const Reply& reply) { return reading_of(format, reply); }
};
using Protocol = ProtocolOf<Format>;

/// The counter that must move from frame to frame; -1: these frames have none.
[[nodiscard]] constexpr int life_counter_of(const Format& format, const Reply& reply) {
  return format.check.life_counter ? reply.life_counter : -1;
}
template <const Format& format>
[[nodiscard]] constexpr int life_counter_of(const KnownFormat<format>&, const ReplyTo<format>& reply) {
  return format.check.life_counter ? reply.life_counter : -1;
}

/// Where frames begin that come later than was thought: believed is what comes twice. A start bit that gets lost makes
/// a frame that is late, too, and whose CRC is good once in 64 times.
class LateFrames {
 public:
  /// `head`: clocks before the start bit, beyond those of the idle line; of a delay near a whole clock one more or
  /// less.
  [[nodiscard]] bool is_again(unsigned head) {
    const unsigned before = std::exchange(seen_, head);
    return before != 0 && head + 1 - before <= 2;
  }

 private:
  unsigned seen_ = 0;
};

/// After power on an encoder may wait for two pulses of MA, with 40 us before and behind them, and show nothing until
/// then. Nobody tells a host when that was: it gives them where its first frame brings nothing, once.
class StartSequence {
 public:
  /// What came of a frame was this.
  [[nodiscard]] bool is_due(Error error) {
    given_ = std::exchange(first_, false) && error == Error::line_stuck;
    return given_;
  }
  /// Whether this transfer were the pulses, behind which the frame is clocked anew.
  [[nodiscard]] bool was_given() { return std::exchange(given_, false); }

 private:
  bool first_ = true;
  bool given_ = false;
};

/// One frame; where there are life counters two, which must follow each other (sequence_mismatch). With `finds`, more
/// clocks are given where the line, or the encoder, takes longer than was thought, and the start sequence.
template <class F, bool finds>
class PositionReader : public author::ClockedHostOf<ProtocolOf<F>> {
  using Base = author::ClockedHostOf<ProtocolOf<F>>;
  using P = ProtocolOf<F>;
  static constexpr unsigned most_late = 4;  // frames until two of them are alike

 public:
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
      // A line that only idles may be one whose delay is longer than was thought: it is looked at once for as long as
      // any line takes.
      if (error == Error::line_stuck && samples[0] && !second_ && !looked_further_) {
        looked_further_ = true;
        return this->clock(P::all_clocks(this->format()));
      }
      const unsigned head = this->last().delay_bits + this->last().ack_bits;
      const bool expected =
          tries_ == 0 && head <= head_bits(this->format(), this->format().latency, this->format().period());
      const bool late = error == Error::none ? !expected && !late_.is_again(head) : needs_more(error, samples);
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
  bool looked_further_ = false;
  std::uint8_t tries_ = 0;
  [[no_unique_address]] std::conditional_t<finds, LateFrames, author::Later> late_{};
  [[no_unique_address]] std::conditional_t<finds, StartSequence, author::NoRequest> start_{};
};
/// What a drive that knows its line repeats.
using ReadPosition = PositionReader<Format, false>;
/// The same of a format that is known when the program is written: `static constexpr Format format{...};`.
template <const Format& format>
class ReadKnownPosition final : public PositionReader<KnownFormat<format>, false> {
 public:
  ReadKnownPosition() : PositionReader<KnownFormat<format>, false>({}) {}
};
template <class F>
using FindPosition = PositionReader<F, true>;

}  // namespace absenc::biss
