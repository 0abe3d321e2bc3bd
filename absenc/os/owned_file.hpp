// SPDX-License-Identifier: Apache-2.0
// A file that one process owns and keeps up to date.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/process.hpp"

namespace absenc::os {

/// Identity of a file, independent of its names.
struct FileIdentity {
  std::uint64_t device = 0;
  std::uint64_t number = 0;  // inode number; 0: no file

  bool operator==(const FileIdentity&) const = default;
};

/// Returns the identity of the file at `path`; its `number` is 0 if stat(2) fails.
[[nodiscard]] FileIdentity identity_of(const std::string& path);

/// A file that this process owns: it is locked (flock) as long as the object exists.
class OwnedFile {
 public:
  /// Opens and locks the file at `path`; creates an empty one if none exists. Throws Failure.
  explicit OwnedFile(const std::string& path);

  /// Returns whether the constructor created the file, because it was missing.
  [[nodiscard]] bool made() const { return made_; }

  /// Replaces the file by a new one with `content`. The path leads to the complete old or the complete new file at
  /// any time, with `Durable::yes` also after a power failure. Throws Failure.
  void replace(std::string_view content, Durable durable);

  /// Returns whether the path still leads to this file, and not to another or none.
  [[nodiscard]] bool has_its_name() const;
  struct State {
    std::int64_t size = 0;         // size of the file in bytes
    std::int64_t modified_ns = 0;  // calendar time of the last write to the file, in nanoseconds
  };
  /// Returns the size and the time of the last write. Throws Failure.
  [[nodiscard]] State state() const;
  /// Returns the first `size` bytes of the file, or fewer if the file is shorter. Throws Failure.
  [[nodiscard]] std::string beginning(std::size_t size) const;

 private:
  std::string path_;
  Descriptor file_;
  bool made_ = false;
};

}  // namespace absenc::os
