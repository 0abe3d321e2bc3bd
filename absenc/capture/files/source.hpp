// SPDX-License-Identifier: Apache-2.0
// The bytes of a capture file, on a disk or in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

namespace absenc::capture {

/// A capture that cannot be opened: a sentence that says why, and what to try.
struct OpenError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Any number of threads may read at once.
struct Source {
  virtual ~Source() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Copies what stands from `offset` on and returns how much: less than asked for only where the file ends, or cannot
  /// be read any further.
  [[nodiscard]] virtual std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) = 0;
};

/// Throws OpenError when the file cannot be opened or is a folder.
[[nodiscard]] std::unique_ptr<Source> file_source(const std::filesystem::path& path);

[[nodiscard]] std::unique_ptr<Source> memory_source(std::vector<std::uint8_t> bytes);

}  // namespace absenc::capture
