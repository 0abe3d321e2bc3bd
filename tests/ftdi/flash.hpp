// SPDX-License-Identifier: Apache-2.0
// A SPI flash memory on the pins of an MPSSE, for programs of other projects that use one. It answers in SPI mode 0.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tests/ftdi/mpsse.hpp"

namespace absenc::ftdi {

/// Identification (9F) and reading (03) of a Winbond W25X10: 128 KiB, whose bytes are a function of their address.
class FlashWires final : public Wires {
 public:
  static constexpr std::size_t size = 128 * 1024;
  [[nodiscard]] static constexpr std::uint8_t content(std::size_t at) {
    return static_cast<std::uint8_t>(at * 7 + (at >> 8) * 13 + (at >> 16));
  }

  void change(Time, std::uint8_t levels, std::uint8_t outputs) override {
    const bool selected = (outputs & Mpsse::tms) != 0 && (levels & Mpsse::tms) == 0;
    const bool high = (levels & Mpsse::clock) != 0;
    if (selected && !selected_) bits_ = command_ = shown_ = 0;
    if (selected && high && !clock_) rises((levels & Mpsse::out) != 0);
    if (selected && !high && clock_) shown_ = next_ & 1;
    selected_ = selected;
    clock_ = high;
  }
  bool data(Time) override { return !selected_ || shown_ != 0; }

 private:
  // The memory takes a bit at the rising edge and shows the next one at the falling edge.
  void rises(bool bit) {
    if (bits_ < 32) command_ = command_ << 1 | (bit ? 1u : 0u);
    ++bits_;
    if (bits_ == 8) code_ = command_ & 0xFF;
    next_ = 0;
    if (code_ == 0x9F && bits_ >= 8 && bits_ < 8 + 24) next_ = 0xEF3011u >> (23 - (bits_ - 8)) & 1;
    if (code_ == 0x03 && bits_ >= 32) {
      const std::size_t at = ((command_ & 0xFFFFFF) + (bits_ - 32) / 8) % size;
      next_ = content(at) >> (7 - bits_ % 8) & 1u;
    }
    if (bits_ < 8) code_ = 0;
  }

  bool selected_ = false, clock_ = false;
  std::size_t bits_ = 0;
  std::uint32_t command_ = 0, code_ = 0, next_ = 0, shown_ = 0;
};

}  // namespace absenc::ftdi
