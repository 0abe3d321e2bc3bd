// SPDX-License-Identifier: Apache-2.0
// Captured frames in the form that the search for their checksum uses.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "absenc/capture/search/crc_search.hpp"
#include "absenc/capture/search/polynomial.hpp"
#include "absenc/core/bits.hpp"

namespace absenc::capture {

/// Layout of a checksum in a frame; `padded`: the checksum is computed as if a byte 00 followed the covered part.
struct Shape {
  unsigned width = 0;  // width of the checksum in bits
  bool refin = false;
  bool refout = false;
  bool low_first = false;
  bool padded = false;
  std::size_t check_size = 0;
  std::size_t trailing = 0;
};

/// Captured frames without duplicates, grouped by length.
class Frames {
 public:
  explicit Frames(std::span<const CheckedFrame> frames) {
    for (const CheckedFrame& frame : frames) {
      const auto same = [&](const CheckedFrame* one) { return one->bits == frame.bits && one->bytes == frame.bytes; };
      if (std::none_of(all.begin(), all.end(), same)) all.push_back(&frame);
    }
    for (const CheckedFrame* frame : all) {
      shortest = std::min(shortest, size(*frame));
      lengths[size(*frame)].push_back(frame);
    }
    of_bits = !all.empty() && all.front()->bits != 0;
  }

  /// Returns the size of a frame in bytes, or in bits for frames of bits.
  [[nodiscard]] static std::size_t size(const CheckedFrame& frame) {
    return frame.bits != 0 ? frame.bits : frame.bytes.size();
  }

  std::vector<const CheckedFrame*> all;
  std::map<std::size_t, std::vector<const CheckedFrame*>> lengths;
  std::size_t shortest = SIZE_MAX;
  bool of_bits = false;
};

inline bool bit_of(const CheckedFrame& frame, std::size_t i) { return (frame.bytes[i / 8] >> (7 - i % 8) & 1) != 0; }

/// Returns the checksum in `frame` as a number; nothing if its field has bits above the width that are not 0.
inline std::optional<std::uint32_t> check_of(const CheckedFrame& frame, const Shape& shape) {
  const std::size_t at = Frames::size(frame) - shape.trailing - shape.check_size;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < shape.check_size; ++i) {
    if (frame.bits != 0) {
      value = value << 1 | (bit_of(frame, at + i) ? 1u : 0u);
    } else {
      value = value << 8 | frame.bytes[at + (shape.low_first ? shape.check_size - 1 - i : i)];
    }
  }
  if (value > low_mask(shape.width)) return std::nullopt;
  return value;
}

/// Calls `take` for each bit that the checksum covers, from byte or bit `first` on; returns the number of these bits.
template <class Take>
std::size_t covered_bits(const CheckedFrame& frame, const Shape& shape, std::size_t first, const Take& take) {
  const std::size_t end = Frames::size(frame) - shape.trailing - shape.check_size;
  if (frame.bits != 0) {
    for (std::size_t i = first; i < end; ++i) take(bit_of(frame, i));
    return end - first;
  }
  for (std::size_t i = first; i < end + (shape.padded ? 1 : 0); ++i) {
    const std::uint8_t byte = i < end ? frame.bytes[i] : std::uint8_t{0};
    for (unsigned bit = 0; bit < 8; ++bit) take((byte >> (shape.refin ? bit : 7 - bit) & 1) != 0);
  }
  return 8 * (end - first + (shape.padded ? 1 : 0));
}

inline std::uint32_t reflected_if(bool reflected, std::uint32_t value, unsigned width) {
  return reflected ? reflect(value, width) : value;
}

/// Returns the covered bits and the checksum of `frame` as one polynomial, after exclusive OR of the first bits with
/// `init` and of the checksum with `xorout`.
inline Polynomial codeword(const CheckedFrame& frame, const Shape& shape, std::size_t first, std::uint32_t check,
                           std::uint32_t init, std::uint32_t xorout) {
  Polynomial word;
  const std::size_t bits = covered_bits(frame, shape, first, [&word](bool bit) { word.append(bit); });
  for (unsigned i = 0; i < shape.width; ++i) word.append(false);
  word ^= Polynomial(reflected_if(shape.refout, check ^ xorout, shape.width));
  if (init != 0) {
    Polynomial start(init);
    for (std::size_t i = 0; i < bits; ++i) start.append(false);
    word ^= start;
  }
  return word;
}

/// Returns the CRC of the covered bits of `frame`, without xorout.
inline std::uint32_t crc_of(const CheckedFrame& frame, const Shape& shape, std::size_t first, std::uint32_t poly,
                            std::uint32_t init) {
  const auto mask = static_cast<std::uint32_t>(low_mask(shape.width));
  std::uint32_t remainder = init;
  covered_bits(frame, shape, first, [&](bool bit) {
    const bool feedback = ((remainder >> (shape.width - 1) & 1) != 0) != bit;
    remainder = (remainder << 1 & mask) ^ (feedback ? poly : 0);
  });
  return reflected_if(shape.refout, remainder, shape.width);
}

}  // namespace absenc::capture
