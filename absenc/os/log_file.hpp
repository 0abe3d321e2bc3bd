// SPDX-License-Identifier: Apache-2.0
// A folder owned by one process, and a file to which bytes are appended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// A folder that this process owns: it is locked (flock) for the lifetime of the object.
class OwnedFolder {
 public:
  /// Creates the folder at `path` if it is missing, but not its parent, and locks it. Throws Failure.
  explicit OwnedFolder(const std::string& path);

  /// Returns whether the path of the folder still leads to it.
  [[nodiscard]] bool is_there() const;

 private:
  std::string path_;
  Descriptor folder_;
};

/// A file that is only appended to, except for `replace` and `shrink_to`.
class LogFile {
 public:
  enum class Open : std::uint8_t { fresh, existing };
  /// Creates the file at `path` (`fresh`) or opens it (`existing`). Throws Failure.
  LogFile(const std::string& path, Open how);

  /// Appends `bytes`; on an error removes the part that was written, if possible. Returns 0 or a value of errno.
  [[nodiscard]] int append(std::string_view bytes);
  /// Replaces the existing byte at `offset`. Returns 0 or a value of errno.
  [[nodiscard]] int replace(std::size_t offset, char byte) const;
  /// Replaces the content of the file by `bytes`, which must not be longer than the content. Returns false on an
  /// error; the content may then be partly old and partly new.
  [[nodiscard]] bool shrink_to(std::string_view bytes);
  /// Returns up to `size` bytes of the file from `offset`; fewer at its end. Throws Failure.
  [[nodiscard]] std::string read(std::size_t offset, std::size_t size) const;
  /// Waits until the content of the file is on the disk. Errors are ignored.
  void sync() const;
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Returns whether the file still has a name.
  [[nodiscard]] bool is_there() const;

 private:
  std::string path_;
  Descriptor file_;
  std::size_t size_ = 0;
};

}  // namespace absenc::os
