// SPDX-License-Identifier: Apache-2.0
// Stores the memory of a virtual encoder in a text file.
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

  /// Fills `memory` from the file, or creates the file. Throws Failure.
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
