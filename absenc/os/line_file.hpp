// SPDX-License-Identifier: Apache-2.0
// Output files that must stay readable after a full disk or a killed process: files of complete lines, or of blocks.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// A new file that this process writes. LineFile and BlockFile check at each write that the file still has its name,
/// once it has one.
class OutputFile {
 public:
  /// Waits until the content is on the disk, where the file system can do that. Throws Failure, also as `require_there`
  /// does.
  void sync();
  /// Throws Failure `lost` if the path does not lead to this file any more, or another program truncated the file.
  /// Throws Failure `system` if that cannot be checked. Checks nothing before the file has its name.
  void require_there() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 protected:
  enum class Appears : std::uint8_t { at_once, later };

  /// Creates the file at `path`; with `later` it gets this name from BlockFile::appear. Throws Failure: `in_use` if a
  /// file exists there, `no_permission`, `not_found`, `system`.
  OutputFile(const std::string& path, Appears appears);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Writes `bytes` at offset `at`. Bytes of a file with a name survive the end of this process, but a power failure
  /// only after `sync`. Returns 0 or a value of errno; then a part of `bytes` may have been written.
  [[nodiscard]] int put(std::uint64_t at, std::string_view bytes);

  std::string path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
  bool appeared_ = false;
  std::string temporary_name_;  // temporary name of the file until `appear`, on file systems without nameless files
};

/// An output file of complete lines.
class LineFile final : public OutputFile {
 public:
  explicit LineFile(const std::string& path) : OutputFile(path, Appears::at_once) {}
  /// Writes `lines` to the system at once; if that fails, as on a full disk, removes the written part. Throws Failure,
  /// also as `require_there` does.
  void append(std::string_view lines);
};

/// An output file that is written in blocks at any offset and has no name until `appear`.
class BlockFile final : public OutputFile {
 public:
  explicit BlockFile(const std::string& path) : OutputFile(path, Appears::later) {}
  /// Gives the file its name. Before this call the file has no name and disappears when the process ends; on file
  /// systems without nameless files it has a temporary name, which a killed process leaves behind. Throws Failure;
  /// `in_use` if another file has taken the name.
  void appear();
  /// Writes `bytes` at offset `at`; a hole between the end and `at` reads as zeros. Throws Failure, also as
  /// `require_there` does.
  void write(std::uint64_t at, Bytes bytes);
  /// Extends the file to at least `size` bytes. Throws Failure.
  void grow(std::uint64_t size);
  /// Fills `bytes` with the content at offset `at`; bytes behind the end read as zeros. Throws Failure.
  void read(std::uint64_t at, MutableBytes bytes) const;
};

}  // namespace absenc::os
