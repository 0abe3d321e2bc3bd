// SPDX-License-Identifier: Apache-2.0
// A folder that one process keeps, and files in it that are only appended to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// A folder, locked (flock) for as long as this lives.
class OwnedFolder {
 public:
  /// Makes it where there is none, but not its parent. Throws Failure: `in_use` when another process keeps it,
  /// `not_found` when its parent is missing.
  explicit OwnedFolder(const std::string& path);

  /// Whether it still has its name: it may have been removed, moved or replaced.
  [[nodiscard]] bool is_there() const;

 private:
  std::string path_;
  Descriptor folder_;
};

class LogFile {
 public:
  enum class Open : std::uint8_t { fresh, existing };
  /// Throws Failure.
  LogFile(const std::string& path, Open how);

  /// Writes all of it at the end, or nothing. Returns 0, or the error of the system.
  [[nodiscard]] int append(std::string_view bytes);
  /// Replaces a byte that is there, which needs no room on the disk. Returns 0, or the error of the system.
  [[nodiscard]] int replace(std::size_t offset, char byte) const;
  /// Replaces all of it by `bytes`, which are no more than there are: that needs no room either. False: nothing was
  /// done, or not all of it.
  [[nodiscard]] bool shrink_to(std::string_view bytes);
  /// Up to `size` bytes: fewer at the end of the file. Throws Failure.
  [[nodiscard]] std::string read(std::size_t offset, std::size_t size) const;
  /// Waits for the disk.
  void sync() const;
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Whether it still has a name.
  [[nodiscard]] bool is_there() const;

 private:
  std::string path_;
  Descriptor file_;
  std::size_t size_ = 0;
};

}  // namespace absenc::os
