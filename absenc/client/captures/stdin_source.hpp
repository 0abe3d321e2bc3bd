// SPDX-License-Identifier: Apache-2.0
// Reads standard input as the bytes of a capture, once and in order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absenc/capture/files/source.hpp"

namespace absenc::client {

/// Standard input as a source of bytes, of which only the last 2 MiB remain available.
class StdinSource final : public capture::Source {
 public:
  StdinSource() : window_(capacity) {}

  /// Returns the greatest number as the size, because the size of standard input is unknown.
  [[nodiscard]] std::uint64_t size() const override { return UINT64_MAX; }
  /// Waits until the wanted bytes have been read, copies them and returns their number. Returns fewer if the input ends
  /// before them, or if they are no longer stored. Throws Failure.
  [[nodiscard]] std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) override;

 private:
  static constexpr std::size_t capacity = std::size_t{2} << 20;

  bool pull(std::uint64_t until);

  std::vector<std::uint8_t> window_;  // ring buffer: byte n of the input is at index n modulo the capacity
  std::uint64_t end_ = 0;             // number of bytes read so far
  bool ended_ = false;
};

}  // namespace absenc::client
