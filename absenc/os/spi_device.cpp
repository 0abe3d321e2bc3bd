// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/spi_device.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "absenc/core/bit_view.hpp"
#include "absenc/os/spi_choice.hpp"

namespace absenc::os {

namespace {

// time for which the chip is deselected between two transfers of a message
constexpr Time deselected_time = std::chrono::microseconds(10);

// Greatest number of bytes that are passed to the device after each selection of the chip; no device reads more.
constexpr std::size_t most_received = 4096;

constexpr bool samples_at_trailing_edge(std::uint8_t mode) { return (mode & 1) != 0; }

std::uint8_t mask_of(std::size_t bit, bool lsb_first) {
  return static_cast<std::uint8_t>(lsb_first ? 0x01u << bit % 8 : 0x80u >> bit % 8);
}

}  // namespace

SpiDevice::SpiDevice(LinkKind kind, const LineSettings& settings, Machine<std::uint8_t>& device)
    : kind_(kind), settings_(settings), device_(&device) {
  if (!host_clocks(kind)) {
    throw std::invalid_argument("behind an SPI controller bytes are exchanged or bits clocked");
  }
}

Time SpiDevice::message(std::span<const SpiTransfer> transfers, Time start) {
  const bool chip_select = kind_ == LinkKind::spi;
  Time at = start;
  bool suited = true;
  bool clocked = false;
  if (chip_select && !selected_) select(at, {});
  for (const SpiTransfer& transfer : transfers) {
    const bool clocks = transfer.size > 0 && !(transfer.out.empty() && transfer.in.empty());
    if (clocks) {
      clocked = true;
      suited = suited && suits(transfer.mode);
      at = clock(transfer, at);
    }
    const bool pauses = transfer.delay > Time{} || transfer.deselect;
    if (!chip_select && pauses) deselect(at);
    at += transfer.delay;
    if (!transfer.deselect || &transfer == &transfers.back()) continue;
    if (chip_select) deselect(at);
    at += deselected_time;
    if (chip_select) select(at, {});
  }
  if (!chip_select || transfers.empty() || !transfers.back().deselect) deselect(at);
  if (clocked) ++messages_;
  if (!suited) ++wrong_modes_;
  return at;
}

void SpiDevice::rest(std::uint8_t mode) { held_low_ = held_low_ || !idles_high(mode); }

void SpiDevice::wake(Time now) {
  if (now < timer_) return;
  timer_ = never;
  feed({.kind = ByteEvent::Kind::timer, .at = now});
}

void SpiDevice::select(Time at, Time period) {
  selected_ = true;
  driven_.clear();
  after_driven_ = ByteStep{}.behind_out();
  received_.clear();
  clocks_ = 0;
  last_out_ = false;
  period_ = lead_ = {};
  selected_at_ = at;
  feed({.kind = ByteEvent::Kind::selected, .at = at, .held_low = std::exchange(held_low_, false), .width = period});
}

void SpiDevice::deselect(Time at) {
  if (!selected_) return;
  selected_ = false;
  if (carries_bits(kind_)) return feed({.kind = ByteEvent::Kind::sent, .at = at, .bits = clocks_});
  feed({.kind = ByteEvent::Kind::received, .at = at, .items = received_});
  feed({.kind = ByteEvent::Kind::sent, .at = at, .bits = clocks_, .width = period_, .lead = lead_});
}

Time SpiDevice::clock(const SpiTransfer& transfer, Time at) {
  const LineSettings clock{.rate = transfer.rate};
  const Time period = clock.bits(1);
  if (!selected_) select(at, period);
  if (clocks_ == 0) lead_ = at - selected_at_;
  period_ = period_ == Time{} ? period : std::min(period_, period);
  received_.resize(std::min(received_.size() + transfer.size, most_received));
  std::fill(transfer.in.begin(), transfer.in.end(), std::uint8_t{0});
  // If the host shifts out at the edge at which the device samples, the device samples the previous bit.
  const bool samples_late = samples_at_trailing_edge(transfer.mode) && !shifts_at_leading_edge(transfer.mode);
  for (std::size_t bit = 0; bit < 8 * transfer.size; ++bit, ++clocks_) {
    const std::uint8_t mask = mask_of(bit, transfer.lsb_first);
    const bool out = !transfer.out.empty() && (transfer.out[bit / 8] & mask) != 0;
    const bool received_bit = samples_late ? last_out_ : out;
    if (received_bit && clocks_ / 8 < received_.size()) received_[clocks_ / 8] |= mask_of(clocks_, false);
    last_out_ = out;
    if (!transfer.in.empty() && driven(clocks_, transfer.mode)) transfer.in[bit / 8] |= mask;
  }
  return at + clock.bits(8 * transfer.size);
}

void SpiDevice::feed(const ByteEvent& event) {
  device_->feed(event);
  run_device(event.at);
}

void SpiDevice::run_device(Time now) {
  for (;;) {
    const ByteStep step = device_->next(now);
    switch (step.kind) {
      case ByteStep::Kind::transfer:
        driven_.assign(step.out.begin(), step.out.end());
        after_driven_ = step.behind_out();
        break;
      case ByteStep::Kind::wait:
        timer_ = step.at > now ? step.at : never;
        return;
      case ByteStep::Kind::done:
        timer_ = never;
        return;
      case ByteStep::Kind::pulse:
      case ByteStep::Kind::configure:
      case ByteStep::Kind::emit:
        break;
    }
  }
}

// A clocked device (SSI, BiSS) works in mode 2 and in mode 3: the clock line idles high, and the device sees the same
// edges in both.
bool SpiDevice::suits(std::uint8_t mode) const {
  return carries_bits(kind_) ? idles_high(mode) : mode == settings_.spi_mode;
}

bool SpiDevice::shifts_at_leading_edge(std::uint8_t mode) const {
  const bool shifts_at_rising_edge =
      carries_bits(kind_) || idles_high(settings_.spi_mode) != samples_at_trailing_edge(settings_.spi_mode);
  return shifts_at_rising_edge != idles_high(mode);
}

// Returns the bit that the controller samples at clock `clock`.
bool SpiDevice::driven(std::size_t clock, std::uint8_t mode) const {
  std::size_t shifts = clock;
  if (samples_at_trailing_edge(mode) && shifts_at_leading_edge(mode)) ++shifts;
  std::size_t before_first_bit = settings_.idle_clocks;
  if (kind_ == LinkKind::spi) {
    before_first_bit = samples_at_trailing_edge(settings_.spi_mode) ? 1 : 0;
  } else if (!idles_high(mode) && shifts > 0) {
    --shifts;  // in modes 0 and 1 the first rising edge comes before the falling edge at which the device latches
  }
  if (shifts < before_first_bit) return true;
  const std::size_t bit = shifts - before_first_bit;
  if (bit >= 8 * driven_.size()) return after_driven_ != 0;
  return BitView{driven_, 8 * driven_.size()}[bit];
}

}  // namespace absenc::os
