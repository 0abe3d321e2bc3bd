// SPDX-License-Identifier: Apache-2.0
// Commands of FTDI's MPSSE, the engine that shifts bits (FTDI application note AN 108, version 1.5; paragraphs
// in brackets).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <vector>

#include "absenc/core/bytes.hpp"

namespace absenc::os {

/// Pins ADBUS0 to ADBUS4 of the chip, as bits of the command that sets them [3.6.1].
struct MpssePin {
  static constexpr std::uint8_t clock = 0x01;      // TCK, output
  static constexpr std::uint8_t out = 0x02;        // TDI, output: data to the encoder
  static constexpr std::uint8_t in = 0x04;         // TDO, input: data of the encoder
  static constexpr std::uint8_t select = 0x08;     // TMS, output: chip select of SPI encoders, active low
  static constexpr std::uint8_t direction = 0x10;  // GPIOL0, output: high while the host drives the data line
  static constexpr std::uint8_t outputs = clock | out | select | direction;
};

/// The clock of an MPSSE: `base` / 2 / (1 + `divisor`) [3.8.1, 3.8.2].
struct MpsseClock {
  std::uint32_t base = 60'000'000;  // Hz; 12 MHz: the FT2232D, which has no faster one [3.8.1]
  std::uint16_t divisor = 0;

  /// Returns the clock rate in Hz, rounded to the nearest integer.
  [[nodiscard]] constexpr std::uint32_t rate() const { return (base / 2 + (divisor + 1u) / 2) / (divisor + 1u); }
  [[nodiscard]] static constexpr std::uint32_t highest(std::uint32_t base) { return base / 2; }
  [[nodiscard]] static constexpr std::uint32_t lowest(std::uint32_t base) { return (base / 2 + 65535) / 65536; }

  /// Returns the clock nearest to `wanted` Hz that is not above `limit` (0: no limit); nothing if `wanted` is out of
  /// the range of the divider.
  [[nodiscard]] static constexpr std::optional<MpsseClock> nearest(std::uint32_t wanted, std::uint32_t base,
                                                                   std::uint32_t limit = 0) {
    if (wanted > highest(base) || wanted < lowest(base)) return std::nullopt;
    const std::uint32_t quotient = base / 2 / wanted;  // the clock of this quotient is at least `wanted`
    const auto of = [base](std::uint32_t one) {
      return MpsseClock{base, static_cast<std::uint16_t>(std::min(one, 65536u) - 1)};
    };
    const MpsseClock above = of(quotient);
    const MpsseClock below = of(quotient + 1);
    if (base / 2 % wanted == 0) return above;
    if (limit != 0 && static_cast<std::uint64_t>(limit) * quotient < base / 2) return below;
    return above.rate() - wanted < wanted - below.rate() ? above : below;
  }
};

/// A sequence of commands for one USB transfer, and the number of bytes that the chip replies to it.
class MpsseCommands {
 public:
  [[nodiscard]] Bytes bytes() const { return bytes_; }
  /// Returns the number of bytes that the chip sends back.
  [[nodiscard]] std::size_t replies() const { return replies_; }
  void clear() {
    bytes_.clear();
    replies_ = 0;
  }

  /// Sets the levels of the pins `outputs`; the others are inputs [3.6.1].
  void set_pins(std::uint8_t levels, std::uint8_t outputs = MpssePin::outputs) { add({0x80, levels, outputs}); }
  /// Sends back the levels of the pins [3.6.3].
  void read_pins() {
    add({0x81});
    ++replies_;
  }
  /// Sets the clock's divisor [3.8.1, 3.8.2].
  void set_divisor(std::uint16_t divisor) {
    add({0x86, static_cast<std::uint8_t>(divisor), static_cast<std::uint8_t>(divisor >> 8)});
  }
  /// Connects the base clock of 60 MHz [6.1], and switches off three-phase clocks [6.4] and adaptive ones [6.10]. Only
  /// for chips with high-speed USB.
  void use_fast_base() { add({0x8A, 0x8D, 0x97}); }
  /// Disconnects the loop from output to input [3.7.2].
  void end_loopback() { add({0x85}); }
  /// A command that no MPSSE has: it answers FA and the command [3.1].
  void unknown() {
    add({0xAA});
    replies_ += 2;
  }
  /// Makes the chip send what it has at once, not only when its latency timer ends [5.1].
  void send_immediate() { add({0x87}); }

  /// Clocks `count` bits in. `falling`: the clock rests high, each of its pulses is low, and the bit is sampled at the
  /// falling edge [3.3.6, 3.3.8]; else the clock rests low, and the bit is sampled at the rising edge [3.3.5, 3.3.7].
  /// These are the two that AN 114 calls supported: a bit is sampled at the first edge of its pulse.
  void shift_in(std::size_t count, bool falling) {
    each(count, [&](std::size_t, std::size_t size, bool whole) {
      command(static_cast<std::uint8_t>((falling ? 0x24 : 0x20) | (whole ? 0 : 0x02)), size);
      replies_ += whole ? size : 1;
    });
  }
  /// Clocks `count` bits of `out` out while the clock rests low: each bit is put out before its pulse, and the next one
  /// follows at the falling edge [3.3.2, 3.3.4].
  void shift_out(Bytes out, std::size_t count) {
    each(count, [&](std::size_t at, std::size_t size, bool whole) {
      command(whole ? 0x11 : 0x13, size);
      append(out, at, size, whole);
    });
  }
  /// Exchanges the bytes of `out` for as many: in SPI mode 2 with `falling`, else in mode 0 [3.3.9].
  void exchange(Bytes out, bool falling) {
    each(8 * out.size(), [&](std::size_t at, std::size_t size, bool) {
      command(falling ? 0x34 : 0x31, size);
      append(out, at, size, true);
      replies_ += size;
    });
  }

 private:
  static constexpr std::size_t most = 65536;  // greatest number of bytes of one shift command [3.3.1]

  // Calls `one` for each command that shifts whole bytes, and for one that shifts the remaining bits: with the index of
  // its first byte, its number of bytes or bits, and whether these are bytes.
  template <class One>
  static void each(std::size_t bits, One one) {
    std::size_t at = 0;
    for (std::size_t left = bits / 8; left > 0; left -= std::min(left, most), at += most) {
      one(at, std::min(left, most), true);
    }
    if (bits % 8 != 0) one(bits / 8, bits % 8, false);
  }
  void command(std::uint8_t code, std::size_t size) {
    const std::size_t length = size - 1;
    add({code, static_cast<std::uint8_t>(length)});
    if ((code & 0x02) == 0) add({static_cast<std::uint8_t>(length >> 8)});
  }
  void append(Bytes out, std::size_t at, std::size_t size, bool whole) {
    const Bytes part = out.subspan(at, whole ? size : 1);
    bytes_.insert(bytes_.end(), part.begin(), part.end());
  }
  void add(std::initializer_list<std::uint8_t> bytes) { bytes_.insert(bytes_.end(), bytes); }

  std::vector<std::uint8_t> bytes_;
  std::size_t replies_ = 0;
};

/// Joins the replies to `MpsseCommands::shift_in` and `read_pins` to a row of bits. The chip sends bits that do not
/// fill a byte in the lowest bits of one [3.3.7, 3.3.8].
class MpsseBits {
 public:
  explicit MpsseBits(Bytes replies) : replies_(replies) {}

  /// Takes the replies to `shift_in(count)`.
  void take_shifted(std::size_t count) {
    for (; count >= 8; count -= 8) add(take(), 8);
    if (count > 0) add(take(), count);
  }
  /// Takes the reply to `read_pins`, and adds the level of the data pin.
  void take_pin() { add((take() & MpssePin::in) != 0 ? 1 : 0, 1); }

  /// Returns the bits, packed MSB first.
  [[nodiscard]] Bytes bytes() const { return bytes_; }

 private:
  std::uint8_t take() { return next_ < replies_.size() ? replies_[next_++] : std::uint8_t{0}; }
  void add(unsigned value, std::size_t count) {
    for (; count > 0; ++size_) {
      if (size_ % 8 == 0) bytes_.push_back(0);
      if ((value >> --count & 1) != 0) bytes_.back() |= static_cast<std::uint8_t>(0x80u >> size_ % 8);
    }
  }

  Bytes replies_;
  std::size_t next_ = 0;
  std::vector<std::uint8_t> bytes_;
  std::size_t size_ = 0;
};

}  // namespace absenc::os
