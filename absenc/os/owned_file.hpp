// SPDX-License-Identifier: Apache-2.0
// A file that one process owns and keeps up to date, for example the memory of a virtual encoder.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/process.hpp"

namespace absenc::os {

/// Identity of a file, independent of its names: two paths with equal identities lead to the same file, unless `number`
/// is 0.
struct FileIdentity {
  std::uint64_t device = 0;
  std::uint64_t number = 0;  // inode number; 0: no file

  bool operator==(const FileIdentity&) const = default;
};

/// Returns the identity of the file at `path`; its `number` is 0 if there is none or stat(2) fails.
[[nodiscard]] FileIdentity identity_of(const std::string& path);

/// A file that this process owns: it is locked (flock) for the lifetime of the object, also while it is replaced. The
/// lock belongs to the file itself, and each new file is locked before it takes the name. A process that opened the old
/// file must check whether that file still has its name.
class OwnedFile {
 public:
  /// Opens and locks the file at `path`; creates an empty file if none exists. Throws Failure: `in_use` if another
  /// process owns it, `unsupported` if it is not a regular file, `system`.
  explicit OwnedFile(const std::string& path);

  /// Returns whether the constructor created the file, because it was missing.
  [[nodiscard]] bool made() const { return made_; }

  /// Replaces the file by a new one with `content`. At every time the path leads to a complete file, the old one or the
  /// new one; with `Durable::yes` also after a power failure. Throws Failure.
  void replace(std::string_view content, Durable durable);

  /// Returns whether the path still leads to this file, and not to another or none.
  [[nodiscard]] bool has_its_name() const;
  struct State {
    std::int64_t size = 0;         // size in bytes
    std::int64_t modified_ns = 0;  // calendar time of the last write, in nanoseconds
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
