// SPDX-License-Identifier: Apache-2.0
// An SSI format that is compiled once, so that it then decodes many words fast.
#pragma once

#include "absenc/protocol/compiled_word.hpp"
#include "absenc/protocol/ssi/frame.hpp"

namespace absenc::ssi {

/// An SSI format whose position word is compiled, so that many words are decoded fast.
class CompiledFormat {
 public:
  /// Compiles `format`, which is copied.
  constexpr explicit CompiledFormat(const Format& format)
      : format_(format), bits_(format.word.bits()), is_possible_(bits_ >= 1 && bits_ <= CompiledWord::maximum_bits) {
    if (is_possible_) word_ = CompiledWord(format.word);
  }
  /// Returns the format that was compiled.
  constexpr operator const Format&() const { return format_; }

  /// Decodes the bits of one reading, with the same result as ssi::decode.
  [[nodiscard]] constexpr Result<Word> decode(const BitView& bits) const {
    if (!is_possible_ || format_.extra_clocks != 0 || bits.size != bits_) return decode_otherwise(bits);
    const std::uint64_t number = bits.load_quickly(0, bits_);
    if (!word_.is_parity_right(number) || (format_.padded && !word_.is_padding_zero(number))) {
      return decode_otherwise(bits);
    }
    return Result<Word>([&] { return word_.values_of<Word>(number); });
  }

 private:
  // Decodes readings that the compiled word cannot decode: those with extra clocks, another number of bits, or an
  // error.
  [[nodiscard, gnu::noinline]] constexpr Result<Word> decode_otherwise(const BitView& bits) const {
    return ssi::decode(format_, bits);
  }

  Format format_;
  unsigned bits_;
  bool is_possible_;
  CompiledWord word_{};
};

/// Decodes a reading with the same result as by the format that `compiled` was made of.
[[nodiscard]] constexpr Result<Word> decode(const CompiledFormat& compiled, const BitView& bits) {
  return compiled.decode(bits);
}

}  // namespace absenc::ssi
