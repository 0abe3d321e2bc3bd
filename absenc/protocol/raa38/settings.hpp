// SPDX-License-Identifier: Apache-2.0
// Settings that a virtual RAA38S6 keeps during power off, and the number of writes to them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/shaft.hpp"

namespace absenc::raa38 {

/// Settings of a virtual encoder, stored in a memory of a few bytes.
class Settings {
 public:
  /// Index in the memory at which the encoder's number on its line is stored, 1 byte.
  static constexpr std::size_t number_at = 0;
  /// Index in the memory at which the bit rate is stored, 1 byte: an index in the table of rates.
  static constexpr std::size_t rate_at = 1;
  /// Index in the memory at which the direction is stored, 1 byte: 1 if the encoder counts down.
  static constexpr std::size_t direction_at = 2;
  /// Index in the memory at which the shaft position that is the encoder's zero is stored, 4 bytes in counts.
  static constexpr std::size_t zero_at = 3;
  /// Index in the memory at which the number of writes is stored, 4 bytes.
  static constexpr std::size_t writes_at = 7;

  /// Creates settings with this address or node number and this index of the bit rate; `shaft` must outlive them.
  Settings(std::uint8_t number, std::uint8_t rate, unsigned bits, const Shaft& shaft) : bits_(bits), shaft_(&shaft) {
    memory_[number_at] = number;
    memory_[rate_at] = rate;
  }

  /// Returns the bytes of the memory.
  [[nodiscard]] MutableBytes memory() { return memory_; }
  /// Returns the version of the memory, which each `write` increments.
  [[nodiscard]] std::uint32_t version() const { return version_; }
  /// Returns the number of the encoder on its line: address or node number.
  [[nodiscard]] std::uint8_t number() const { return memory_[number_at]; }
  /// Returns the index of the bit rate in the protocol's table of rates.
  [[nodiscard]] std::uint8_t rate() const { return memory_[rate_at]; }
  /// Returns whether the encoder counts down.
  [[nodiscard]] bool counts_down() const { return memory_[direction_at] != 0; }
  /// Returns how often settings were written.
  [[nodiscard]] std::uint32_t writes() const { return load(writes_at); }

  /// Returns the encoder's position in counts. Counting down mirrors it at the zero.
  [[nodiscard]] std::uint32_t position(Time at) const {
    const std::uint32_t up = counts(at) - load(zero_at);
    return static_cast<std::uint32_t>((counts_down() ? 0u - up : up) & low_mask(bits_));
  }
  /// Writes a setting at index `at` of the memory. Returns false if the memory had this value already.
  bool write(std::size_t at, Bytes value) {
    const MutableBytes kept = MutableBytes(memory_).subspan(at, value.size());
    const bool changes = !std::equal(value.begin(), value.end(), kept.begin());
    std::copy(value.begin(), value.end(), kept.begin());
    store_little_endian(MutableBytes(memory_).subspan(writes_at, 4), writes() + 1u);
    ++version_;
    return changes;
  }
  /// Makes the present shaft position the zero. Returns false if the memory had this zero already.
  bool write_zero(Time at) {
    std::array<std::uint8_t, 4> zero{};
    store_little_endian(zero, counts(at));
    return write(zero_at, zero);
  }

 private:
  [[nodiscard]] std::uint32_t load(std::size_t at) const {
    return static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(at, 4)));
  }
  [[nodiscard]] std::uint32_t counts(Time at) const {
    return static_cast<std::uint32_t>(shaft_->at(at).position) >> (32 - bits_);
  }

  unsigned bits_;
  const Shaft* shaft_;
  std::array<std::uint8_t, writes_at + 4> memory_{};
  std::uint32_t version_ = 0;
};

}  // namespace absenc::raa38
