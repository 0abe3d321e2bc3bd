// SPDX-License-Identifier: Apache-2.0
// Output files that must stay readable after a full disk or a killed process: files of complete lines, or of blocks.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// A new file that this process writes; it must still have its name at every write.
class OutputFile {
 public:
  /// Waits until the content is on the disk. Throws Failure, also as `require_there` does.
  void sync();
  /// Throws Failure `lost` if the path does not lead to this file any more or the file was truncated: further data
  /// would not be found.
  void require_there() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 protected:
  enum class Appears : std::uint8_t { at_once, later };

  /// Creates the file. Throws Failure: `in_use` if the file exists, `no_permission`, `not_found`, `system`.
  OutputFile(const std::string& path, Appears appears);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Writes `bytes` at offset `at`. They survive the end of this process, and a power failure only after `sync`.
  /// Returns 0 or a value of errno.
  [[nodiscard]] int put(std::uint64_t at, std::string_view bytes);

  std::string path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
  bool appeared_ = false;
  std::string temporary_name_;  // temporary name until `appear`, on file systems without nameless files
};

/// An output file of complete lines.
class LineFile final : public OutputFile {
 public:
  explicit LineFile(const std::string& path) : OutputFile(path, Appears::at_once) {}
  /// Writes `lines` to the system at once, which takes a few us. If they do not all fit, none of them remains. Throws
  /// Failure, also as `require_there` does.
  void append(std::string_view lines);
};

/// An output file that is written in blocks at any offset and has no name until `appear`.
class BlockFile final : public OutputFile {
 public:
  explicit BlockFile(const std::string& path) : OutputFile(path, Appears::later) {}
  /// Gives the file its name. Before this call no other process sees the file, and it disappears when the process ends.
  /// Throws Failure; `in_use` if another file has taken the name.
  void appear();
  /// Writes at any offset; a hole between the end and `at` reads as zeros. Throws Failure, also as `require_there`
  /// does.
  void write(std::uint64_t at, Bytes bytes);
  /// Extends the file to at least `size` bytes. Throws Failure.
  void grow(std::uint64_t size);
  /// Reads `bytes` at offset `at`; bytes behind the end read as zeros. Throws Failure.
  void read(std::uint64_t at, MutableBytes bytes) const;
};

}  // namespace absenc::os
