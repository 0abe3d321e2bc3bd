// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/ssi/device.hpp"

#include <algorithm>

namespace absenc::ssi {

namespace {
constexpr Time period_of(std::uint32_t khz) { return LineSettings{.rate = khz * 1000}.bits(1); }
}  // namespace

void VirtualEncoder::selected(Time at, Time period, bool, author::DrivenBits& bits) {
  if (period > 0ns) {
    const bool allowed = period >= period_of(format_.fastest_khz) && period <= period_of(format_.slowest_khz);
    expect(allowed, "clock outside min_clock_khz to max_clock_khz", at);
  }
  // Within the monoflop time the shift register still holds the old word.
  if (!expect(at >= free_at_, "clocked again within monoflop_us", at)) {
    shifted_ %= 2 * (format_.word.bits() + (format_.after_word == AfterWord::separated ? 1 : 0));
  } else {
    latched_ = word_of(format_.word, shaft_->at(at), raised());
    shifted_ = 0;
  }
  // After the last clock the line is low for the monoflop time, unless ones follow the word.
  if (format_.after_word != AfterWord::one) hold_low(monoflop());
  BitBuffer<WordFormat::maximum_bits> coded;
  encode_whole(format_, latched_, coded);
  const bool repeats = format_.after_word == AfterWord::repeat || format_.after_word == AfterWord::separated;
  const std::size_t count = repeats ? author::DrivenBits::capacity() : (format_.word.bits() + 7) / 8 * 8;
  hosts_take(std::max(2 * format_.word.bits(), clocks(format_)));
  for (std::size_t i = 0; i < count; ++i) bits.append(bit_after_word(format_, coded.view(), shifted_ + i) ? 1 : 0, 1);
}

void VirtualEncoder::clocked(Time at, std::size_t clocks) {
  shifted_ += clocks;
  expect(shifted_ >= format_.word.bits(), "fewer clocks than the word has bits", at);
  free_at_ = at + monoflop();
  count_answer();
}

}  // namespace absenc::ssi
