// SPDX-License-Identifier: Apache-2.0
// Files of ours that must still be readable after the disk was full or the process killed: of whole lines, or of
// blocks.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

class OwnFile {
 public:
  /// Waits for the disk. Throws Failure, as `require_there` too.
  void sync();
  /// Throws Failure, `lost`, when the file is no longer what its path leads to, or was cut: what is written then is
  /// nowhere to be found.
  void require_there() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 protected:
  enum class Appears : std::uint8_t { at_once, later };

  /// Makes the file. Throws Failure: `in_use` when there is one already, `no_permission`, `not_found`, `system`.
  OwnFile(const std::string& path, Appears appears);
  ~OwnFile();
  OwnFile(const OwnFile&) = delete;
  OwnFile& operator=(const OwnFile&) = delete;

  /// What is written survives the end of this process (not of the power: `sync`). Returns 0, or the error of the
  /// system.
  [[nodiscard]] int put(std::uint64_t at, std::string_view bytes);

  std::string path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
  bool appeared_ = false;
  std::string beside_;  // its name until it appears, where the file system has no files without a name
};

class LineFile final : public OwnFile {
 public:
  explicit LineFile(const std::string& path) : OwnFile(path, Appears::at_once) {}
  /// Hands `lines` to the system at once, which costs a few us. When they do not all fit, none of them stays. Throws
  /// Failure, as `require_there` too.
  void append(std::string_view lines);
};

class BlockFile final : public OwnFile {
 public:
  explicit BlockFile(const std::string& path) : OwnFile(path, Appears::later) {}
  /// Gives the file its name: until then nobody sees it, and it is gone when the process ends. Throws Failure, `in_use`
  /// too when another has taken the name meanwhile.
  void appear();
  /// Anywhere; what lies between the end and `at` is zero. Throws Failure, as `require_there` too.
  void write(std::uint64_t at, Bytes bytes);
  /// Makes it at least so long. Throws Failure.
  void grow(std::uint64_t size);
  /// What is behind the end is zero. Throws Failure.
  void read(std::uint64_t at, MutableBytes bytes) const;
};

}  // namespace absenc::os
