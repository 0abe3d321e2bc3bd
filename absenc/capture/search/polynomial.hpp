// SPDX-License-Identifier: Apache-2.0
// Polynomials over GF(2) whose degree is large enough for all bits of a frame.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace absenc::capture {

/// A polynomial whose coefficients are bits, of a degree below `capacity`.
class Polynomial {
 public:
  static constexpr std::size_t capacity = 640;

  constexpr Polynomial() = default;
  constexpr explicit Polynomial(std::uint64_t low) : words_{low} {}

  /// Multiplies by x and adds `bit`, the next bit of a frame.
  constexpr void append(bool bit) {
    std::uint64_t carry = bit ? 1 : 0;
    for (std::uint64_t& word : words_) {
      const std::uint64_t out = word >> 63;
      word = word << 1 | carry;
      carry = out;
    }
  }

  /// Returns the degree; -1 for the polynomial 0.
  [[nodiscard]] constexpr int degree() const {
    for (std::size_t i = words_.size(); i-- > 0;) {
      if (words_[i] != 0) return static_cast<int>(64 * i) + 63 - std::countl_zero(words_[i]);
    }
    return -1;
  }
  [[nodiscard]] constexpr bool bit(int power) const {
    return (words_[static_cast<std::size_t>(power) / 64] >> (power % 64) & 1) != 0;
  }
  [[nodiscard]] constexpr std::uint64_t low() const { return words_[0]; }

  constexpr Polynomial& operator^=(const Polynomial& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] ^= other.words_[i];
    return *this;
  }

  /// Leaves the remainder of a division by `divisor`, which must not be 0; returns the quotient.
  constexpr Polynomial divide(const Polynomial& divisor) {
    Polynomial quotient;
    const int step = divisor.degree();
    for (int top = degree(); top >= step; top = degree()) {
      subtract_shifted(divisor, top - step);
      quotient.words_[static_cast<std::size_t>(top - step) / 64] |= std::uint64_t{1} << ((top - step) % 64);
    }
    return quotient;
  }

  friend constexpr bool operator==(const Polynomial&, const Polynomial&) = default;

 private:
  constexpr void subtract_shifted(const Polynomial& other, int shift) {
    const auto words = static_cast<std::size_t>(shift) / 64;
    const int bits = shift % 64;
    for (std::size_t i = words_.size(); i-- > words;) {
      words_[i] ^= other.words_[i - words] << bits;
      if (bits != 0 && i > words) words_[i] ^= other.words_[i - words - 1] >> (64 - bits);
    }
  }

  std::array<std::uint64_t, capacity / 64> words_{};
};

/// Returns the greatest common divisor of two polynomials; if one of them is 0, the other.
[[nodiscard]] constexpr Polynomial greatest_common_divisor(Polynomial a, Polynomial b) {
  while (b.degree() >= 0) {
    static_cast<void>(a.divide(b));
    std::swap(a, b);
  }
  return a;
}

/// Returns the divisors of `value`, not 0, of `degree`, 1 to 16, with the constant term 1.
[[nodiscard]] std::vector<std::uint32_t> divisors_of_degree(std::uint64_t value, unsigned degree);

}  // namespace absenc::capture
