// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/rough_line.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "absenc/core/bit_view.hpp"
#include "absenc/sim/can_bits.hpp"

namespace absenc::sim {

namespace {

// Copies `items` to `to`, which mostly had as many items before, so that resize rarely allocates.
template <class Item>
void copy(std::span<const Item> items, std::vector<Item>& to) {
  to.resize(items.size());
  std::copy(items.begin(), items.end(), to.begin());
}

}  // namespace

template <class Item>
RoughLine<Item>::RoughLine(LinkKind kind, LineSettings settings, Machine<Item>& device, std::uint64_t seed)
    : kind_(kind),
      settings_(settings),
      device_(device),
      random_(seed),
      byte_time_(settings.byte_time()),
      host_rate_(settings.rate),
      device_rate_(settings.rate) {
  serve_device();
}

template <class Item>
void RoughLine<Item>::set_rates(const RoughRates& rates) {
  rates_ = rates;
  draw_skip();
}

template <class Item>
Time RoughLine<Item>::now() {
  last_event_at_ = time_;
  return time_;
}

template <class Item>
void RoughLine<Item>::begin(const Step<Item>& step) {
  using Kind = typename Step<Item>::Kind;
  if (step.kind == Kind::configure) set_rate(host_rate_, step.rate);
  if (step.kind != Kind::transfer && step.kind != Kind::pulse) return;
  ++counts_.requests;
  run_until(std::max(time_, step.at));
  if (step.kind == Kind::pulse) {
    feed({.kind = Event<Item>::Kind::triggered, .at = time_, .wire = step.wire, .width = step.width});
    run_until(time_ + step.width);
  } else if (host_clocks(kind_)) {
    kind_ == LinkKind::clocked_bidirectional ? exchange_bits(step) : transfer(step);
  } else {
    copy(step.out, request_);
    if constexpr (std::is_same_v<Item, CanFrame>) {
      for (const CanFrame& frame : request_) {
        run_until(time_ + settings_.bits(can_bit_count(frame) + can_intermission_bits));
        deliver_request({&frame, 1});
      }
    } else if (!request_.empty()) {
      const std::size_t pauses = step.frame == 0 ? 0 : (request_.size() - 1) / step.frame;
      run_until(time_ + byte_time_ * static_cast<std::int64_t>(request_.size()) +
                step.width * static_cast<std::int64_t>(pauses));
      deliver_request(request_);
    }
  }
  sent_due_ = true;
  silence_.sent(time_);
}

template <class Item>
void RoughLine<Item>::set_rate(std::uint32_t& end, std::uint32_t rate) {
  if (host_clocks(kind_)) return;
  end = settings_.rate = rate;
  byte_time_ = settings_.byte_time();
}

template <class Item>
void RoughLine<Item>::deliver_request(std::span<const Item> request) {
  using Kind = typename Event<Item>::Kind;
  if (host_rate_ != device_rate_) return feed({.kind = Kind::line_error, .at = time_});
  feed({.kind = Kind::received, .at = time_, .items = request});
}

// Exchanges the items of a transfer; on SPI and clocked links the device's reply is complete at its end.
template <class Item>
void RoughLine<Item>::transfer(const Step<Item>& step) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    using Kind = typename Event<Item>::Kind;
    const bool clocked = carries_bits(kind_);
    const std::size_t size = clocked ? (step.bits + 7) / 8 : std::max(step.out.size(), step.expect);
    bits_ = clocked ? step.bits : size * 8;
    request_.assign(step.out.begin(), step.out.end());
    request_.resize(size, 0);
    out_.clear();
    behind_out_ = Step<Item>{}.behind_out();
    const Time start = time_;
    const Time period = settings_.bits(1);
    const Time lead = clocked ? Time{} : settings_.select_lead;
    feed({.kind = Kind::selected, .at = time_, .held_low = step.hold_low, .width = clocked ? period : Time{}});
    run_until(time_ + lead + settings_.bits(bits_));
    out_.resize(size, behind_out_);
    const std::size_t unclocked = size * 8 - bits_;
    if (unclocked != 0) out_.back() = static_cast<Item>(out_.back() >> unclocked << unclocked);
    enqueue(start, time_, time_, out_);
    if (!clocked) feed({.kind = Kind::received, .at = time_, .items = request_});
    feed({.kind = Kind::sent, .at = time_, .bits = bits_, .width = clocked ? Time{} : period, .lead = lead});
  }
}

// The host's bits arrive when the data line turns, the encoder's at the end of the transfer.
template <class Item>
void RoughLine<Item>::exchange_bits(const Step<Item>& step) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    using Kind = typename Event<Item>::Kind;
    const Time start = time_;
    if (step.rate != 0) settings_.rate = step.rate;
    if (!std::exchange(goes_on_, step.goes_on)) {
      clocks_ = driven_from_ = 0;
      out_.clear();
      behind_out_ = Step<Item>{}.behind_out();
      feed({.kind = Kind::selected, .at = time_, .width = settings_.bits(1)});
    }
    request_.assign(step.out.begin(), step.out.end());
    if (step.out_bits > 0) {
      run_until(start + settings_.bits(step.out_bits));
      driven_from_ = clocks_ + step.out_bits;
      out_.clear();
      feed({.kind = Kind::received, .at = time_, .items = request_, .bits = step.out_bits, .clocks_before = clocks_});
    }
    run_until(start + settings_.bits(step.bits));
    bits_ = step.bits - step.out_bits;
    std::vector<Item> in((bits_ + 7) / 8, 0);
    const BitView driven{out_, 8 * out_.size()};
    for (std::size_t bit = 0; bit < bits_; ++bit) {
      const std::size_t place = clocks_ + step.out_bits + bit - driven_from_;
      const bool level = place < driven.size ? driven[place] : behind_out_ != 0;
      if (level) in[bit / 8] = static_cast<Item>(in[bit / 8] | 0x80u >> bit % 8);
    }
    clocks_ += step.bits;
    if (!in.empty()) {
      enqueue(start, time_, time_, in);
      in_transit_[back_ - 1].bits = bits_;
    }
    if (!step.goes_on) feed({.kind = Kind::sent, .at = time_, .bits = clocks_});
  }
}

template <class Item>
Event<Item> RoughLine<Item>::wait(const Step<Item>& step) {
  using Kind = typename Event<Item>::Kind;
  if (std::exchange(sent_due_, false)) return report({.kind = Kind::sent, .at = time_});
  const Time timer = step.at > last_event_at_ ? step.at : never;
  for (;;) {
    Time quiet = silence_.due(step.answer, step.gap);
    const Time arrival = front_ != back_ ? in_transit_[front_].at : never;
    // an item arrives before the silence would be reported, so the line is not silent
    if (arrival != never && in_transit_[front_].first <= quiet) quiet = never;
    const Time mine = std::min(timer, quiet);
    const Time next = due();
    if (next != never && next <= std::min(mine, arrival)) {
      time_ = std::max(time_, next);
      run_device();
      continue;
    }
    if (arrival != never && arrival <= mine) {
      time_ = std::max(time_, arrival);
      return deliver();
    }
    if (mine == never) throw std::logic_error("a wait on a line for what can never happen");
    time_ = std::max(time_, mine);
    if (timer <= quiet) return report({.kind = Kind::timer, .at = time_});
    silence_.reported();
    return report({.kind = Kind::silence, .at = time_});
  }
}

template <class Item>
void RoughLine<Item>::rest(Time until) {
  run_until(until);
}

template <class Item>
void RoughLine<Item>::drop() {
  while (front_ != back_ && in_transit_[front_].at <= time_) ++front_;
  if (front_ == back_) front_ = back_ = 0;
}

template <class Item>
void RoughLine<Item>::mark() {
  mark_ = time_;
  old_.clear();
}

template <class Item>
Event<Item> RoughLine<Item>::report(const Event<Item>& event) {
  last_event_at_ = event.at;
  return event;
}

template <class Item>
Event<Item> RoughLine<Item>::deliver() {
  using Kind = typename Event<Item>::Kind;
  InTransit& arrived = in_transit_[front_++];
  if (arrived.sent < mark_) old_.push_back(arrived.sent);
  std::swap(reported_items_, arrived.items);
  if (front_ == back_) front_ = back_ = 0;
  silence_.received(time_);
  if (reported_items_.empty()) return report({.kind = Kind::line_error, .at = time_});
  return report({.kind = Kind::received, .at = time_, .items = reported_items_, .bits = arrived.bits});
}

// ---- Device side

template <class Item>
Time RoughLine<Item>::due() const {
  return std::min(side_.timer, side_.sending ? side_.end : side_.silence.due(side_.answer, side_.gap));
}

template <class Item>
void RoughLine<Item>::run_until(Time limit) {
  for (Time next = due(); next <= limit && next != never; next = due()) {
    time_ = std::max(time_, next);
    run_device();
  }
  time_ = std::max(time_, limit);
}

template <class Item>
void RoughLine<Item>::run_device() {
  using Kind = typename Event<Item>::Kind;
  if (side_.sending && side_.end <= time_) {
    side_.sending = false;
    feed({.kind = Kind::sent, .at = time_});
  } else if (side_.timer <= time_) {
    side_.timer = never;
    feed({.kind = Kind::timer, .at = time_});
  } else {
    side_.silence.reported();
    feed({.kind = Kind::silence, .at = time_});
  }
}

template <class Item>
void RoughLine<Item>::feed(const Event<Item>& event) {
  using Kind = typename Event<Item>::Kind;
  if (event.kind == Kind::received || event.kind == Kind::line_error) side_.silence.received(event.at);
  if (event.kind == Kind::sent) side_.silence.sent(event.at);
  device_.feed(event);
  serve_device();
}

// Carries out the steps of the device's machine until the machine waits or is done.
template <class Item>
void RoughLine<Item>::serve_device() {
  while (carry_out(device_.next(time_))) {
  }
}

// Carries out one step. Returns whether the device must be asked for another one.
template <class Item>
bool RoughLine<Item>::carry_out(const Step<Item>& step) {
  using Kind = typename Step<Item>::Kind;
  if (step.kind == Kind::done) return false;
  if (step.kind == Kind::wait) {
    side_.answer = step.answer;
    side_.gap = step.gap;
    side_.timer = step.at > time_ ? step.at : never;
    return false;
  }
  if (step.kind == Kind::configure) set_rate(device_rate_, step.rate);
  if (step.kind == Kind::transfer) send(step);
  return true;
}

template <class Item>
void RoughLine<Item>::send(const Step<Item>& step) {
  copy(step.out, out_);
  behind_out_ = step.behind_out();
  if (host_clocks(kind_)) return;
  const Time start = std::max(step.at, time_);
  side_.sending = true;
  side_.end = start;
  if constexpr (std::is_same_v<Item, CanFrame>) {
    for (const CanFrame& frame : out_) {
      const Time begun = side_.end;
      side_.end += settings_.bits(can_bit_count(frame) + can_intermission_bits);
      enqueue(begun, side_.end, side_.end, {&frame, 1});
    }
  } else {
    side_.end += byte_time_ * static_cast<std::int64_t>(out_.size());
    enqueue(start, start + byte_time_, side_.end, out_);
  }
}

template <class Item>
void RoughLine<Item>::enqueue(Time start, Time first, Time end, std::span<const Item> items) {
  ++counts_.replies;
  if (back_ == in_transit_.size()) in_transit_.emplace_back();
  InTransit& arrived = in_transit_[back_];
  copy(items, arrived.items);
  damage(arrived.items);
  if (host_rate_ != device_rate_) arrived.items.clear();
  const Time late = host_clocks(kind_) ? Time{} : lateness();
  // A frame does not arrive before the frames sent before it, because a line keeps their order.
  const Time before = back_ != front_ ? in_transit_[back_ - 1].at : Time{};
  arrived.sent = start;
  arrived.at = std::max(end + late, before);
  arrived.first = std::max(first + late, std::min(before, arrived.at));
  ++back_;
}

// ---- Faults

template <class Item>
Time RoughLine<Item>::lateness() {
  if (rates_.late <= 0 || !random_.chance(rates_.late)) return {};
  ++counts_.late;
  const double decades = 6 * static_cast<double>(random_.next() >> 11) * 0x1p-53;
  return Time(static_cast<std::int64_t>(1e4 * std::pow(10.0, decades)));
}

template <class Item>
void RoughLine<Item>::draw_skip() {
  skip_ = ~std::uint64_t{0};
  if (rates_.bit <= 0) return;
  if (rates_.bit >= 1) {
    skip_ = 0;
    return;
  }
  // One is added to the random number so that `chance` is never 0, whose logarithm is infinite.
  const double chance = static_cast<double>((random_.next() >> 11) + 1) * 0x1p-53;
  skip_ = static_cast<std::uint64_t>(std::log(chance) / std::log1p(-rates_.bit));
}

template <class Item>
void RoughLine<Item>::flip(std::vector<Item>& items, std::size_t bit) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    items[bit / 8] = static_cast<Item>(items[bit / 8] ^ (0x80u >> (bit % 8)));
  }
}

template <class Item>
bool RoughLine<Item>::flip_bits(std::vector<Item>& items, std::size_t count) {
  std::size_t at = 0;
  bool any = false;
  while (skip_ < count - at) {
    at += static_cast<std::size_t>(skip_);
    flip(items, at++);
    any = true;
    draw_skip();
  }
  if (skip_ != ~std::uint64_t{0}) skip_ -= count - at;
  if (rates_.burst <= 0 || !random_.chance(rates_.burst)) return any;
  const std::size_t length = std::min<std::size_t>(count, 2 + random_.below(15u));
  const std::size_t first = random_.below(count - length + 1);
  for (std::size_t i = 0; i < length; ++i) {
    if (i == 0 || i + 1 == length || random_.below(2) != 0) flip(items, first + i);
  }
  return true;
}

template <class Item>
void RoughLine<Item>::double_item(std::vector<Item>& items, std::size_t count) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    if (!host_clocks(kind_)) {
      const auto which = items.begin() + static_cast<std::ptrdiff_t>(random_.below(items.size()));
      items.insert(which, *which);
      return;
    }
    const std::vector<Item> before = items;
    for (std::size_t bit = 1 + random_.below(count); bit < count; ++bit) {
      const bool now = (before[bit / 8] >> (7 - bit % 8) & 1) != 0;
      const bool wanted = (before[(bit - 1) / 8] >> (7 - (bit - 1) % 8) & 1) != 0;
      if (now != wanted) flip(items, bit);
    }
  }
}

template <class Item>
void RoughLine<Item>::add_other_sender(std::vector<Item>& items) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    const std::size_t size = items.size();
    const std::size_t first = random_.below(size);
    const std::size_t end = first + 1 + random_.below(size);
    for (std::size_t i = first; i < end; ++i) {
      const auto other = static_cast<Item>(random_.below(256));
      if (i < items.size()) {
        items[i] = static_cast<Item>(items[i] & other);
      } else if (!host_clocks(kind_)) {
        items.push_back(other);
      }
    }
  }
}

template <class Item>
void RoughLine<Item>::damage(std::vector<Item>& items) {
  if (items.empty()) return;
  std::size_t count = items.size() * 8;
  if constexpr (std::is_same_v<Item, CanFrame>) count = can_bit_count(items.front());
  if (carries_bits(kind_)) count = bits_;
  if (count == 0) return;
  bool struck = flip_bits(items, count);
  const bool talked = rates_.talker > 0 && random_.chance(rates_.talker);
  if (talked) add_other_sender(items);
  struck = struck || talked;
  if constexpr (std::is_same_v<Item, CanFrame>) {
    if (struck) items.clear();  // on CAN the controllers detect the damage, and no node receives the frame
  }
  if (rates_.doubled > 0 && random_.chance(rates_.doubled) && !items.empty()) {
    double_item(items, count);
    // A doubled CAN frame: the sender repeats a frame when the acknowledge bit is lost.
    if constexpr (std::is_same_v<Item, CanFrame>) items.push_back(items.front());
    struck = true;
  }
  counts_.damaged += struck ? 1 : 0;
}

template class RoughLine<std::uint8_t>;
template class RoughLine<CanFrame>;

}  // namespace absenc::sim
