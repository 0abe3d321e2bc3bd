// SPDX-License-Identifier: Apache-2.0
// Standard input as the bytes of a capture: read once, from the front to the back.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absenc/capture/files/source.hpp"

namespace absenc::client {

/// Keeps the last 2 MiB, so that the beginning can be looked at more than once. What is further back is as good as
/// not there.
class StdinSource final : public capture::Source {
 public:
  StdinSource() : window_(capacity) {}

  /// Not known: as much as can be asked for.
  [[nodiscard]] std::uint64_t size() const override { return UINT64_MAX; }
  /// Waits until all of it has come, or the end. Throws Failure.
  [[nodiscard]] std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) override;

 private:
  static constexpr std::size_t capacity = std::size_t{2} << 20;

  bool pull(std::uint64_t until);

  std::vector<std::uint8_t> window_;  // byte n of the input stands at n modulo capacity
  std::uint64_t end_ = 0;             // bytes read so far
  bool ended_ = false;
};

}  // namespace absenc::client
