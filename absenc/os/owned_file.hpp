// SPDX-License-Identifier: Apache-2.0
// A file that one process keeps up to date, as the memory of a virtual encoder.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/process.hpp"

namespace absenc::os {

/// Tells files apart, whatever their names.
struct FileIdentity {
  std::uint64_t device = 0;
  std::uint64_t number = 0;  // 0: there is no file

  bool operator==(const FileIdentity&) const = default;
};

/// Of the file at `path`.
[[nodiscard]] FileIdentity identity_of(const std::string& path);

/// Locked (flock) from the constructor to the end of the object, also while it is replaced: the lock is on the file
/// itself, and on each new one before it takes the place. Whoever opened the old one looks whether it still has its
/// name.
class OwnedFile {
 public:
  /// Makes an empty file where there is none. Throws Failure: `in_use` when another process keeps it, `unsupported`
  /// when it is no regular file.
  explicit OwnedFile(const std::string& path);

  /// Whether the constructor made it.
  [[nodiscard]] bool made() const { return made_; }

  /// There is always a whole file, the old one or the new one. Afterwards the system has it, whatever becomes of this
  /// process; with `Durable::yes` the disk has it too. Throws Failure.
  void replace(std::string_view content, Durable durable);

  /// Whether the path still leads to this file.
  [[nodiscard]] bool has_its_name() const;
  struct State {
    std::int64_t size = 0;         // bytes
    std::int64_t modified_ns = 0;  // calendar time of the last write
  };
  /// Throws Failure.
  [[nodiscard]] State state() const;
  /// The first `size` bytes, or as many as there are. Throws Failure.
  [[nodiscard]] std::string beginning(std::size_t size) const;

 private:
  std::string path_;
  Descriptor file_;
  bool made_ = false;
};

}  // namespace absenc::os
