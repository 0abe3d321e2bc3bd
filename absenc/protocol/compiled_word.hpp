// SPDX-License-Identifier: Apache-2.0
// Decodes position words fast: a word format is compiled into shifts and masks, which are applied to the word as one
// number of at most 64 bits.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/core/gray.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc {

/// A word format compiled into shifts and masks. Decoding with it gives the same values as `decode_word`.
class CompiledWord {
 public:
  /// Greatest number of bits of a word and of the bits behind it in the same number, together.
  static constexpr unsigned maximum_bits = 64;

  constexpr CompiledWord() = default;
  /// Compiles `format` for numbers of at most 64 bits whose lowest `behind` bits follow the word.
  constexpr explicit CompiledWord(const WordFormat& format, unsigned behind = 0) : gray_(format.gray()) {
    const unsigned top = format.bits() + behind;
    unsigned place = top;
    for (std::size_t i = 0; i < format.fields().size(); ++i) {
      const WordField& field = format.fields()[i];
      place -= field.bits;
      const Part part{low_mask(field.bits), static_cast<std::uint8_t>(place), static_cast<std::uint8_t>(i)};
      if (field.active_low) inverted_ |= part.mask << place;
      if (field.meaning == Meaning::position) position_ = part;
      if (field.meaning == Meaning::multiturn) multiturn_ = part;
      if (field.meaning == Meaning::error) error_ = part.mask << place;
      if (field.meaning == Meaning::warning) warning_ = part.mask << place;
      if (field.meaning == Meaning::skip) skipped_ |= part.mask << place;
      if (field.meaning == Meaning::value) values_[value_count_++] = part;
      if (field.meaning == Meaning::parity) {
        parity_ = low_mask(top) & ~low_mask(place);
        odd_ = field.active_low;
      }
    }
  }

  /// Returns whether the parity of the word in `number` is right; true if the word has none.
  [[nodiscard]] constexpr bool is_parity_right(std::uint64_t number) const {
    return parity_ == 0 || odd_parity(number & parity_) == odd_;
  }
  /// Returns whether all skipped bits of the word in `number` are 0.
  [[nodiscard]] constexpr bool is_padding_zero(std::uint64_t number) const { return (number & skipped_) == 0; }

  /// Returns the values of the word in `number`. `Values`: an instance of the template WordWith.
  template <class Values>
  [[nodiscard]] constexpr Values values_of(std::uint64_t number) const {
    const std::uint64_t high = number ^ inverted_;
    std::uint64_t position = position_.of(high);
    std::uint64_t multiturn = multiturn_.of(high);
    if (gray_) decode_gray(position, multiturn);
    return Values{.position = position,
                  .multiturn = multiturn,
                  .error = (high & error_) != 0,
                  .warning = (high & warning_) != 0,
                  .values = numbers_of<Values::capacity>(high)};
  }

 private:
  // The place of a field in the number whose bits are those of the word.
  struct Part {
    std::uint64_t mask = 0;
    std::uint8_t shift = 0;
    std::uint8_t index = 0;  // index of the field in the format

    [[nodiscard]] constexpr std::uint64_t of(std::uint64_t number) const { return number >> shift & mask; }
  };

  // Returns the values of the fields with Meaning::value.
  template <std::size_t size>
  [[nodiscard]] constexpr std::array<std::uint64_t, size> numbers_of(std::uint64_t high) const {
    // The array is cleared in two halves, because g++ clears a whole array by a slow `rep stos`.
    std::array<std::uint64_t, size> numbers;
    for (std::size_t i = 0; i < size / 2; ++i) numbers[i] = 0;
    for (std::size_t i = size / 2; i < size; ++i) numbers[i] = 0;
    if constexpr (size != 0) {
      for (std::size_t i = 0; i < value_count_; ++i) numbers[values_[i].index] = values_[i].of(high);
    }
    return numbers;
  }

  // Decodes turns and position, which are one Gray-coded number.
  constexpr void decode_gray(std::uint64_t& position, std::uint64_t& multiturn) const {
    const bool turns_first = multiturn_.shift > position_.shift;
    std::uint64_t& upper = turns_first ? multiturn : position;
    std::uint64_t& lower = turns_first ? position : multiturn;
    const std::uint64_t mask = turns_first ? position_.mask : multiturn_.mask;
    const auto bits = static_cast<unsigned>(std::popcount(mask));
    const std::uint64_t binary = gray_decode(upper << bits | lower);
    upper = binary >> bits;
    lower = binary & mask;
  }

  Part position_{};
  Part multiturn_{};
  std::uint64_t inverted_ = 0;  // mask of the bits of active-low fields
  std::uint64_t error_ = 0;
  std::uint64_t warning_ = 0;
  std::uint64_t skipped_ = 0;
  std::uint64_t parity_ = 0;  // mask of the parity bit and all bits that it covers; 0: the word has no parity bit
  bool odd_ = false;
  bool gray_ = false;
  std::uint8_t value_count_ = 0;
  // places of the fields that carry other values than position, turns and flags (Meaning::value)
  std::array<Part, WordFormat::maximum_fields> values_{};
};

}  // namespace absenc
