// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/search/polynomial.hpp"

namespace absenc::capture {

namespace {

constexpr unsigned highest_degree = 16;

// Returns the degree of `value` plus 1. The return type of std::bit_width differs between libraries.
unsigned width_of(std::uint64_t value) { return static_cast<unsigned>(std::bit_width(value)); }

/// Returns the irreducible polynomials of degree 1 to 16 in rising order; the polynomial x is left out.
const std::vector<std::uint32_t>& irreducible_polynomials() {
  static const std::vector<std::uint32_t> all = [] {
    constexpr std::uint32_t limit = 1u << (highest_degree + 1);
    std::vector<bool> product(limit);
    std::vector<std::uint32_t> found;
    for (std::uint32_t p = 2; p < limit; ++p) {
      if (product[p]) continue;
      if (p != 2) found.push_back(p);
      for (std::uint32_t q = 2; width_of(p) + width_of(q) <= highest_degree + 2; ++q) {
        std::uint32_t multiple = 0;
        for (unsigned i = 0; i < width_of(q); ++i) multiple ^= (q >> i & 1) != 0 ? p << i : 0;
        product[multiple] = true;
      }
    }
    return found;
  }();
  return all;
}

std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  std::uint64_t product = 0;
  for (; b != 0; b >>= 1, a <<= 1) product ^= (b & 1) != 0 ? a : 0;
  return product;
}

/// Divides `value` by `divisor`, leaves the remainder in `value` and returns the quotient.
std::uint64_t divide(std::uint64_t& value, std::uint64_t divisor) {
  std::uint64_t quotient = 0;
  const unsigned width = width_of(divisor);
  while (width_of(value) >= width) {
    const unsigned shift = width_of(value) - width;
    value ^= divisor << shift;
    quotient |= std::uint64_t{1} << shift;
  }
  return quotient;
}

}  // namespace

std::vector<std::uint32_t> divisors_of_degree(std::uint64_t value, unsigned degree) {
  value >>= std::countr_zero(value);
  std::vector<std::uint64_t> found{1};
  const auto multiply = [&](std::uint64_t factor, unsigned power) {
    std::vector<std::uint64_t> more;
    for (const std::uint64_t one : found) {
      std::uint64_t product = one;
      for (unsigned i = 0; i <= power && width_of(product) <= degree + 1; ++i) {
        more.push_back(product);
        product = times(product, factor);
      }
    }
    found = std::move(more);
  };
  for (const std::uint32_t factor : irreducible_polynomials()) {
    if (width_of(factor) > degree + 1) break;
    if (2 * (width_of(factor) - 1) > width_of(value) - 1) break;  // what is left of `value` is irreducible
    unsigned power = 0;
    for (std::uint64_t rest = value, quotient = divide(rest, factor); rest == 0; quotient = divide(rest, factor)) {
      ++power;
      value = rest = quotient;
    }
    if (power != 0) multiply(factor, power);
  }
  if (value != 1 && width_of(value) <= degree + 1) multiply(value, 1);
  std::vector<std::uint32_t> of_degree;
  for (const std::uint64_t one : found) {
    if (width_of(one) == degree + 1) of_degree.push_back(static_cast<std::uint32_t>(one));
  }
  return of_degree;
}

}  // namespace absenc::capture
