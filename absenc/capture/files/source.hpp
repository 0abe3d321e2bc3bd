// SPDX-License-Identifier: Apache-2.0
// Access to the bytes of a capture file, on a disk or in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

namespace absenc::capture {

/// Exception for a capture that cannot be opened; its text states the reason.
struct OpenError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The bytes of a capture file. Several threads may read at once.
struct Source {
  virtual ~Source() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Copies bytes from `offset` on; returns their number, fewer at the end or on failure.
  [[nodiscard]] virtual std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) = 0;
};

/// Returns the name of `path` in UTF-8; on Windows the conversion of std::filesystem has another encoding.
[[nodiscard]] inline std::string name_of(const std::filesystem::path& path) {
  const std::u8string name = path.u8string();
  return {name.begin(), name.end()};
}

/// Opens a regular file as a source of bytes. Throws OpenError.
[[nodiscard]] std::unique_ptr<Source> file_source(const std::filesystem::path& path);

[[nodiscard]] std::unique_ptr<Source> memory_source(std::vector<std::uint8_t> bytes);

}  // namespace absenc::capture
