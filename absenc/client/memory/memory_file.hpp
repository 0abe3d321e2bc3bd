// SPDX-License-Identifier: Apache-2.0
// Stores the memory of a virtual encoder in a text file that people can edit. memory_file.cpp describes the format.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/os/owned_file.hpp"

namespace absenc::client {

class MemoryFile {
 public:
  /// Takes the path, which may be a symbolic link; opens nothing.
  MemoryFile(const std::string& path, std::string_view protocol, std::string_view model);

  /// Fills `memory` from the file, or creates the file from `memory` if there is none, and locks the file. Throws
  /// Failure, and changes neither memory nor file, if the file is of another kind, damaged, of another protocol, model
  /// or size, locked by another emulator, or not writable.
  void load(MutableBytes memory);

  /// Replaces the content of the loaded file atomically. Throws Failure.
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
