// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/edges.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "absenc/core/bits.hpp"

// This file is compiled once for each instruction set (hwy/foreach_target.h): the compiler's own, SSE4 and AVX2.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE_256 | HWY_SVE2 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "absenc/capture/lines/edges.cpp"
#include <hwy/foreach_target.h>
// The library Highway requires that this file is included after foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace absenc::capture::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t word = 64;  // number of samples whose changes are collected as bits of one integer
// number of samples that are searched for one channel after the other, so that they stay in a cache
constexpr std::size_t piece = 64 * word;

// Returns the levels of a channel in 64 samples: bit i is the level in sample i.
template <class T>
HWY_INLINE std::uint64_t levels(const std::uint8_t* HWY_RESTRICT samples, T channel_bit) {
  std::uint64_t bits = 0;
  // Samples have their least significant byte first, and so have the masks that Highway stores.
  if constexpr (HWY_TARGET == HWY_SCALAR || std::endian::native != std::endian::little) {
    for (std::size_t i = 0; i < word; ++i) {
      const auto sample = static_cast<T>(load_little_endian(Bytes(samples + i * sizeof(T), sizeof(T))));
      bits |= static_cast<std::uint64_t>((sample & channel_bit) != 0) << i;
    }
  } else {
    const hn::CappedTag<T, word> d;
    const hn::Repartition<std::uint8_t, decltype(d)> bytes;
    const auto tested = hn::Set(d, channel_bit);
    for (std::size_t i = 0; i < word; i += hn::Lanes(d)) {
      const auto lanes = hn::BitCast(d, hn::LoadU(bytes, samples + i * sizeof(T)));
      std::array<std::uint8_t, 8> stored{};
      hn::StoreMaskBits(d, hn::TestBit(lanes, tested), stored.data());
      bits |= std::bit_cast<std::uint64_t>(stored) << i;
    }
  }
  return bits;
}

// Writes to `out` the tick of each bit set in `toggles`, and up to 7 meaningless values after them. Returns the end of
// the meaningful values.
HWY_INLINE Tick* put(std::uint64_t toggles, Tick base, Tick* out) {
  const auto count = static_cast<std::size_t>(std::popcount(toggles));
  for (std::size_t i = 0; i < count; i += 8) {
    for (std::size_t j = 0; j < 8; ++j) {
      out[i + j] = base + static_cast<unsigned>(std::countr_zero(toggles));
      toggles &= toggles - 1;
    }
  }
  return out + count;
}

template <class T>
class Finder {
 public:
  Finder(const std::uint8_t* samples, std::size_t count, Tick first)
      : samples_(samples), count_(count), first_(first) {}

  void find(std::size_t begin, unsigned channel, bool& level, std::vector<Tick>& at) {
    const auto channel_bit = static_cast<T>(T{1} << channel);
    const std::size_t end = std::min(begin + piece, count_);
    std::uint64_t carry = level ? 1 : 0;
    Tick* out = found_.data();
    std::size_t i = begin;
    for (; i + word <= end; i += word) {
      out = step(samples_ + i * sizeof(T), channel_bit, i, ~std::uint64_t{0}, carry, out);
    }
    if (i < end) {
      std::memcpy(rest_.data(), samples_ + i * sizeof(T), (end - i) * sizeof(T));
      out = step(rest_.data(), channel_bit, i, ~std::uint64_t{0} >> (word - (end - i)), carry, out);
    }
    at.insert(at.end(), found_.data(), out);
    level = level != ((out - found_.data()) % 2 != 0);
  }

 private:
  HWY_INLINE Tick* step(const std::uint8_t* samples, T channel_bit, std::size_t i, std::uint64_t valid,
                        std::uint64_t& carry, Tick* out) const {
    const std::uint64_t now = levels(samples, channel_bit);
    const std::uint64_t toggles = (now ^ (now << 1 | carry)) & valid;
    carry = now >> (word - 1);
    return toggles == 0 ? out : put(toggles, first_ + i, out);
  }

  const std::uint8_t* samples_;
  std::size_t count_;
  Tick first_;
  std::array<std::uint8_t, word * sizeof(T)> rest_{};
  std::array<Tick, piece + 8> found_;
};

template <class T>
void find_in(const Block& block, std::span<const unsigned> channels, std::span<Changes> changes) {
  const std::size_t count = sample_count(block);
  Finder<T> finder(block.samples.data(), count, block.first);
  std::array<bool, 64> levels{};
  for (std::size_t i = 0; i < channels.size(); ++i) levels[i] = changes[i].before;
  for (std::size_t begin = 0; begin < count; begin += piece) {
    for (std::size_t i = 0; i < channels.size(); ++i) finder.find(begin, channels[i], levels[i], changes[i].at);
  }
}

void find(const Block& block, std::span<const unsigned> channels, std::span<Changes> changes) {
  switch (block.bytes_per_sample) {
    case 1:
      return find_in<std::uint8_t>(block, channels, changes);
    case 2:
      return find_in<std::uint16_t>(block, channels, changes);
    case 4:
      return find_in<std::uint32_t>(block, channels, changes);
    default:
      return find_in<std::uint64_t>(block, channels, changes);
  }
}

}  // namespace
}  // namespace absenc::capture::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace absenc::capture {

// The library libhwy would tell, too, which instruction sets the processor has, but it measures its clock at the start
// of each program, which takes as long as all else in `absenc --version`.
std::span<const ChangeFinder> change_finders() {
  static const std::vector<ChangeFinder> finders = [] {
    std::vector<ChangeFinder> found;
#if HWY_TARGETS & HWY_AVX2
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
        __builtin_cpu_supports("fma") && __builtin_cpu_supports("pclmul") && __builtin_cpu_supports("aes")) {
      found.push_back(N_AVX2::find);
    }
#endif
#if HWY_TARGETS & HWY_SSE4
    if (__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("pclmul") && __builtin_cpu_supports("aes")) {
      found.push_back(N_SSE4::find);
    }
#endif
    found.push_back(HWY_STATIC_DISPATCH(find));
    return found;
  }();
  return finders;
}

void find_changes(const Block& block, std::span<const unsigned> channels, std::span<Changes> changes) {
  const ChangeFinder find = change_finders().front();
  for (Changes& each : changes) each.at.clear();
  for (std::size_t i = 0; i < channels.size(); i += 64) {
    const std::size_t count = std::min<std::size_t>(64, channels.size() - i);
    find(block, channels.subspan(i, count), changes.subspan(i, count));
  }
}

void append(Changes& changes, const Changes& next, Tick first) {
  if (level_after(changes) != next.before) changes.at.push_back(first);
  changes.at.insert(changes.at.end(), next.at.begin(), next.at.end());
}

}  // namespace absenc::capture
#endif
