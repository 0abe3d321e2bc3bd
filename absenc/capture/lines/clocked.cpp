// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/clocked.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace absenc::capture {

namespace {

constexpr Tick no_change = std::numeric_limits<Tick>::max();
constexpr std::size_t most_periods = 4096;

void put_bit(std::vector<std::uint8_t>& bytes, std::size_t bit, bool level) {
  if (bit % 8 == 0) bytes.push_back(0);
  bytes.back() = static_cast<std::uint8_t>(bytes.back() | (level ? 0x80u >> bit % 8 : 0u));
}

}  // namespace

std::optional<ClockRests> find_rests(const Changes& clock) {
  constexpr std::size_t most_lengths = 12;
  std::vector<Tick> periods;
  std::vector<Tick> rests;
  for (std::size_t i = 1; i < clock.at.size() && periods.size() < most_periods; ++i) {
    rests.push_back(clock.at[i] - clock.at[i - 1]);
    if (i > 1) periods.push_back(clock.at[i] - clock.at[i - 2]);
  }
  if (periods.empty()) return std::nullopt;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  ClockRests found{.half_period = std::max<Tick>(*middle / 2, 1), .pauses = {3 * *middle}};
  std::sort(rests.begin(), rests.end());
  found.longest = rests.back();
  for (std::size_t i = 1; i < rests.size() && found.pauses.size() <= most_lengths; ++i) {
    const Tick shorter = rests[i - 1];
    const Tick longer = rests[i];
    // Rests of the clock count as rests of two different lengths if their lengths differ by more than a seventh, and by
    // more than the sampling error of two level changes.
    if (longer <= found.half_period || longer - shorter <= std::max<Tick>(2, shorter / 7)) continue;
    found.pauses.push_back(std::min(shorter + (longer - shorter) / 2, 2 * shorter));
  }
  return found;
}

void ClockedDecoder::Wire::begin(const Changes* changes, Tick first, bool known) {
  border.reset();
  left = {};
  if (changes == nullptr) return;
  left = changes->at;
  if (known && level != changes->before) border = first;
  if (!known) level = changes->before;
}

Tick ClockedDecoder::Wire::next() const {
  if (border) return *border;
  return left.empty() ? no_change : left.front();
}

void ClockedDecoder::Wire::step() {
  level = !level;
  if (border) {
    border.reset();
  } else {
    left = left.subspan(1);
  }
}

bool ClockedDecoder::Wire::before(Tick at) {
  if (border && *border < at) step();
  std::size_t passed = 0;
  while (passed < left.size() && left[passed] < at) ++passed;
  level = level != (passed % 2 != 0);
  left = left.subspan(passed);
  return level;
}

void ClockedDecoder::begin_part(const ClockedPart& part) {
  has_in_ = part.in != nullptr;
  has_out_ = part.out != nullptr;
  has_direction_ = part.direction != nullptr;
  clock_.begin(part.clock, part.first, begun_);
  in_.begin(part.in, part.first, begun_);
  out_.begin(part.out, part.first, begun_);
  select_.begin(part.select, part.first, begun_);
  direction_.begin(part.direction, part.first, begun_);
  if (begun_) return;
  begun_ = true;
  last_ = part.first;
  if (format_.has_select && select_.level == format_.select_high) open(part.first, true, nullptr);
}

// Begins a burst at the tick `at`. If one of `targets`, the bursts that another decoder found, begins at that tick in
// the same state, returns true instead.
bool ClockedDecoder::open(Tick at, bool cut, Targets* targets) {
  if (targets != nullptr && !cut) {
    while (targets->next < targets->bursts.size() && targets->bursts[targets->next].begin < at) ++targets->next;
    const Burst* const target =
        targets->next < targets->bursts.size() ? &targets->bursts[targets->next] : targets->open;
    targets->met = target != nullptr && target->begin == at && !target->cut && target->fell_before == fell_;
    if (targets->met) return true;
  }
  open_ = lone_ = true;
  burst_ = {};
  burst_.begin = at;
  burst_.cut = cut;
  burst_.fell_before = fell_;
  burst_.low_before = !format_.has_select && !clock_.level;
  return false;
}

void ClockedDecoder::close(Tick at, bool cut, std::vector<Burst>& bursts) {
  open_ = false;
  burst_.end = at;
  burst_.cut = burst_.cut || cut;
  burst_.low_after = !format_.has_select && !clock_.level;
  const bool is_word = burst_.bits > 0 && (format_.has_select || !lone_);
  fell_ = !is_word && (fell_ || burst_.low_after);
  if (is_word) bursts.push_back(std::move(burst_));
  burst_ = {};
}

void ClockedDecoder::take(Tick at, std::vector<Burst>& bursts) {
  if (burst_.bits == most_bits) {
    close(at, true, bursts);
    open(at, true, nullptr);
    lone_ = false;
  }
  if (has_in_) put_bit(burst_.in, burst_.bits, in_.before(at));
  if (has_out_) put_bit(burst_.out, burst_.bits, out_.before(at));
  if (has_direction_) put_bit(burst_.direction, burst_.bits, direction_.before(at));
  ++burst_.bits;
}

// Takes the samples behind the last clock change that are due before `until`, as far as the format asks for them. The
// clock of a line whose exchanges have different rates is measured in the burst itself.
void ClockedDecoder::sample_last_bits(Tick until) {
  if (format_.settle == 0 || !has_in_) return;
  const Tick half = format_.low_goes_on ? std::max<Tick>(half_, 1) : format_.settle;
  if (!burst_.has_last && last_ + half < until) {
    burst_.last = in_.before(last_ + half);
    burst_.has_last = true;
  }
  while (burst_.has_last && burst_.tail_bits < format_.tail) {
    const Tick at = last_ + (2 * burst_.tail_bits + 3) * half;
    if (at >= until) return;
    burst_.tail = burst_.tail << 1 | (in_.before(at) ? 1u : 0u);
    ++burst_.tail_bits;
  }
}

// A data change at the tick `until` itself counts, because the order of two changes in one sample is unknown.
void ClockedDecoder::detect_data_change(Tick until) {
  if (format_.change_pause == 0 || !has_in_ || until - last_ <= format_.settle) return;
  if (open_) sample_last_bits(until);
  in_.before(last_ + format_.settle);
  changed_ = changed_ || in_.next() <= until;
}

bool ClockedDecoder::is_over(Tick rest) const {
  if (format_.low_goes_on) {
    if (!clock_.level) return false;
    // A pause between fast exchanges may be shorter than half a period of the clock of slow ones.
    if (open_ && rest > 3 * half_) return true;
  }
  return rest > format_.pause || (changed_ && rest > format_.change_pause);
}

bool ClockedDecoder::clock_changes(Tick at, Targets* targets, std::vector<Burst>& bursts) {
  if (!format_.has_select) {
    detect_data_change(at);
    if (is_over(at - last_)) {
      seen_pause_ = true;
      if (open_) {
        sample_last_bits(at);
        close(last_, false, bursts);
      }
    }
    if (!open_ && open(at, !seen_pause_, targets)) return true;
  }
  lone_ = open_ && at == burst_.begin;
  half_ = at - last_;
  burst_.has_last = changed_ = false;
  burst_.tail = burst_.tail_bits = 0;
  clock_.step();
  last_ = at;
  if (open_ && clock_.level == format_.rising) take(at, bursts);
  return false;
}

bool ClockedDecoder::select_changes(Tick at, Targets* targets, std::vector<Burst>& bursts) {
  const bool active = select_.level != format_.select_high;
  if (active && open(at, false, targets)) return true;
  select_.step();
  if (!active && open_) close(at, false, bursts);
  return false;
}

// Decodes a part of the capture. Returns true if it stopped early because a burst begins together with one of
// `targets`.
bool ClockedDecoder::run(const ClockedPart& part, Targets* targets, std::vector<Burst>& bursts) {
  begin_part(part);
  for (;;) {
    const Tick clock = clock_.next();
    const Tick select = format_.has_select ? select_.next() : no_change;
    if (clock == no_change && select == no_change) break;
    if (clock <= select ? clock_changes(clock, targets, bursts) : select_changes(select, targets, bursts)) return true;
  }
  if (!format_.has_select && open_) sample_last_bits(part.end);
  detect_data_change(part.end);
  // To decode the next part of the capture, the levels of the data lines after the last clock change of this part are
  // needed.
  in_.before(no_change);
  out_.before(no_change);
  direction_.before(no_change);
  if (!format_.has_select && open_ && is_over(part.end - last_)) {
    seen_pause_ = true;
    close(last_, false, bursts);
  }
  return false;
}

void ClockedDecoder::decode(const ClockedPart& part, std::vector<Burst>& bursts) { run(part, nullptr, bursts); }

void ClockedDecoder::join(const ClockedPart& part, ClockedDecoder& other, std::vector<Burst>& guessed,
                          std::vector<Burst>& bursts) {
  Targets targets{guessed, other.open_ ? &other.burst_ : nullptr};
  if (!run(part, &targets, bursts)) return;
  const auto from = guessed.begin() + static_cast<std::ptrdiff_t>(targets.next);
  bursts.insert(bursts.end(), std::make_move_iterator(from), std::make_move_iterator(guessed.end()));
  std::swap(*this, other);
}

void ClockedDecoder::finish(std::vector<Burst>& bursts) {
  if (open_) close(last_, true, bursts);
  restart();
}

}  // namespace absenc::capture
