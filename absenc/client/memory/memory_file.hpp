// SPDX-License-Identifier: Apache-2.0
// The memory of a virtual encoder in a file, for people to read and edit. memory_file.cpp describes the format.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/os/owned_file.hpp"

namespace absenc::client {

class MemoryFile {
 public:
  /// `path` may be a symbolic link. Nothing is opened yet.
  MemoryFile(const std::string& path, std::string_view protocol, std::string_view model);

  /// Fills `memory` from the file, or makes the file from `memory` when there is none. From then on it is locked.
  /// Throws Failure, and leaves both as they are, when the file is none of ours, damaged, of another model or size,
  /// kept by another emulator, or cannot be written.
  void load(MutableBytes memory);

  /// Replaces the file, which was loaded, in one go. Throws Failure.
  void save(Bytes memory, os::Durable durable);

 private:
  [[nodiscard]] std::string to_text(Bytes memory) const;
  void parse(std::string_view text, MutableBytes memory) const;

  std::string path_;
  std::string protocol_;
  std::string model_;
  std::optional<os::OwnedFile> file_;
};

}  // namespace absenc::client
