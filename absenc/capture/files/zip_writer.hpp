// SPDX-License-Identifier: Apache-2.0
// Writes a zip archive, entry by entry.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace absenc::capture {

/// A new archive, which appears under its name only when it is finished. All functions throw std::runtime_error.
class ZipWriter {
 public:
  explicit ZipWriter(std::filesystem::path path);
  ~ZipWriter();
  ZipWriter(const ZipWriter&) = delete;
  ZipWriter& operator=(const ZipWriter&) = delete;

  /// Begins the next entry, which `write` fills.
  void begin(const std::string& name);
  void write(std::span<const std::uint8_t> bytes);
  /// Adds a whole entry.
  void add(const std::string& name, std::string_view content);
  /// Writes the directory, and replaces a file at the path by the archive.
  void finish();

 private:
  [[noreturn]] void fail() const;
  void end_entry();

  struct Close {
    void operator()(void* archive) const;
  };
  std::filesystem::path path_;
  std::filesystem::path temporary_path_;
  std::unique_ptr<void, Close> archive_;
  bool in_entry_ = false;
};

}  // namespace absenc::capture
