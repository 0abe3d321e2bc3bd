// SPDX-License-Identifier: Apache-2.0
// Host side of BiSS-C: the host drives MA and samples SLO.
#pragma once

#include <algorithm>
#include <type_traits>

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
    return {format.ma_khz * 1000, timeout_maximum};
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

/// One frame; a second one with more clocks where the line, or the encoder, takes longer than was thought. Where there
/// are life counters two, which must follow each other (sequence_mismatch).
template <class F>
class ReadPositionOf : public author::ClockedHostOf<ProtocolOf<F>> {
  using Base = author::ClockedHostOf<ProtocolOf<F>>;

 public:
  explicit ReadPositionOf(const F& format) : Base(format) {}

 private:
  void clocked(BitView samples) final {
    const int before = life_counter_of(this->format(), this->found());
    const Error error = this->take(samples);
    if (!extended_ && needs_more(error, samples)) {
      extended_ = true;
      return this->clock(ProtocolOf<F>::all_clocks(this->format()));
    }
    if (error != Error::none || before < 0) return this->conclude(error);
    const int now = life_counter_of(this->format(), this->found());
    if (second_) {
      const bool follows = now == static_cast<int>((static_cast<unsigned>(before) + 1) & low_mask(life_counter_bits));
      return this->conclude(follows ? Error::none : Error::sequence_mismatch);
    }
    second_ = true;
    this->clock(extended_ ? ProtocolOf<F>::all_clocks(this->format()) : ProtocolOf<F>::clocks(this->format()));
  }

  bool second_ = false;
  bool extended_ = false;
};
using ReadPosition = ReadPositionOf<Format>;

}  // namespace absenc::biss
