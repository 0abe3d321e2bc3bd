// SPDX-License-Identifier: Apache-2.0
// A BiSS word with its check, compiled into shifts, masks and the table of its CRC.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_crc.hpp"
#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/biss/check.hpp"
#include "absenc/protocol/compiled_word.hpp"

namespace absenc::biss {

/// A word and its check, compiled. `Entry` and `rows` are the template arguments of its CRC table, BitCrc.
template <class Entry = std::uint16_t, std::size_t rows = 16>
class CompiledChannel {
 public:
  /// Returns the number of bits that the CRC of `format` covers: word and life counter.
  template <class Described>
  [[nodiscard]] static constexpr unsigned covered_bits(const Described& format) {
    return format.word.bits() + (format.check.life_counter ? life_counter_bits : 0);
  }

  /// Compiles the members `word` and `check` of `format`; does nothing if `is_possible()` is false.
  template <class Described>
  constexpr explicit CompiledChannel(const Described& format)
      : covered_(covered_bits(format)), width_(format.check.width), life_counter_(format.check.life_counter) {
    if (!is_possible()) return;
    word_ = CompiledWord(format.word, covered_ - format.word.bits());
    crc_ = BitCrc<Entry, rows>(parameters_of(format.check), covered_);
  }

  /// Returns whether word and life counter together have 1 to 64 bits, as `load` demands.
  [[nodiscard]] constexpr bool is_possible() const { return covered_ >= 1 && covered_ <= CompiledWord::maximum_bits; }
  /// Returns the number of bits of word, life counter and CRC.
  [[nodiscard]] constexpr unsigned bits() const { return covered_ + width_; }
  /// Returns whether the word has a CRC.
  [[nodiscard]] constexpr bool has_crc() const { return width_ != 0; }

  /// The bits of a received word, split into the part that the CRC covers and the CRC.
  struct Bits {
    std::uint64_t covered = 0;  ///< Word and life counter.
    std::uint16_t crc = 0;      ///< CRC as the encoder sent it; 0 if the format has none.
  };
  /// Returns the bits of the word that begins at index `first` of `samples`.
  [[nodiscard, gnu::always_inline]] constexpr Bits load(const BitView& samples, std::size_t first) const {
    return {
        samples.load_quickly(first, covered_),
        width_ == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(samples.load_quickly(first + covered_, width_))};
  }
  /// Returns whether CRC and parity are right.
  [[nodiscard, gnu::always_inline]] constexpr bool is_right(const Bits& sent) const {
    return sent.crc == crc_(sent.covered) && word_.is_parity_right(sent.covered);
  }
  /// Returns the values of the word. `Values`: an instance of the template WordWith.
  template <class Values>
  [[nodiscard, gnu::always_inline]] constexpr Values values_of(const Bits& sent) const {
    return word_.values_of<Values>(sent.covered);
  }
  /// Returns the life counter; 0 if the check has none.
  [[nodiscard]] constexpr std::uint8_t life_counter_of(const Bits& sent) const {
    return life_counter_ ? static_cast<std::uint8_t>(sent.covered & low_mask(life_counter_bits)) : std::uint8_t{0};
  }

 private:
  CompiledWord word_{};
  BitCrc<Entry, rows> crc_{};
  unsigned covered_;
  unsigned width_;
  bool life_counter_;
};

}  // namespace absenc::biss
