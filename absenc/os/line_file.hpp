// SPDX-License-Identifier: Apache-2.0
// Output files of complete lines, or of blocks.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// An output file that this process creates and writes.
class OutputFile {
 public:
  /// Waits until the content is on the disk, if the file system can do that. Throws Failure.
  void sync();
  /// Throws Failure if the path of the file, once the file has this name, no longer leads to it, or if another program
  /// has shortened the file.
  void require_there() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 protected:
  enum class Appears : std::uint8_t { at_once, later };

  /// Creates the file: at once under the name `path`, or nameless until BlockFile::appear gives it this name. Throws
  /// Failure.
  OutputFile(const std::string& path, Appears appears);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Writes `bytes` at offset `at`. Returns 0 or a value of errno; after an error, some of the bytes may have been
  /// written.
  [[nodiscard]] int put(std::uint64_t at, std::string_view bytes);
  /// Sets the size of the file. Returns 0 or a value of errno.
  [[nodiscard]] int resize(std::uint64_t size);
  /// Throws Failure for a file that cannot be made at `path`; `error`: the value of errno.
  [[noreturn]] static void refuse(const std::string& path, int error);

  std::string path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
  bool appeared_ = false;
  std::string temporary_name_;  // temporary name until `appear`, on file systems without nameless files; else empty
};

/// An output file of complete lines.
class LineFile final : public OutputFile {
 public:
  explicit LineFile(const std::string& path) : OutputFile(path, Appears::at_once) {}
  /// Writes `lines`; if that fails, removes the part that was written, if possible. Throws Failure.
  void append(std::string_view lines);
};

/// An output file that is written in blocks at any offset and gets its name by `appear`.
class BlockFile final : public OutputFile {
 public:
  explicit BlockFile(const std::string& path) : OutputFile(path, Appears::later) {}
  /// Gives the file its name. Throws Failure; `in_use` if another file has taken the name.
  void appear();
  /// Writes `bytes` at offset `at`; a hole before it reads as zeros. Throws Failure.
  void write(std::uint64_t at, Bytes bytes);
  /// Extends the file to at least `size` bytes. Throws Failure.
  void grow(std::uint64_t size);
  /// Fills `bytes` with the content from offset `at` on, behind the end with zeros. Throws Failure.
  void read(std::uint64_t at, MutableBytes bytes) const;
};

}  // namespace absenc::os
