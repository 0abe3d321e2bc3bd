// SPDX-License-Identifier: Apache-2.0
// A zip archive whose entries only one thread at a time may read; open it once for each thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absenc/capture/files/source.hpp"

namespace absenc::capture {

class ZipArchive {
 public:
  /// `source` must outlive the archive. Throws OpenError with libzip's message.
  explicit ZipArchive(Source& source);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  struct Entry {
    std::uint64_t index = 0;
    std::uint64_t size = 0;  // size in the directory, which is reliable only after the entry was read
  };
  /// Finds an entry by its name. Returns false if there is none.
  [[nodiscard]] bool find(const std::string& name, Entry& entry) const;

  /// Returns the names of all entries, in the order of the archive.
  [[nodiscard]] std::vector<std::string> names() const;

  /// Expands a whole deflated entry into `into`, which must have its size, four times as fast as `open` and `read`.
  /// Returns true only if the entry is complete and its checksum is right; otherwise `open` and `read` return as much
  /// as possible and report the error.
  [[nodiscard]] bool expand(const Entry& entry, std::span<std::uint8_t> into);

  /// Begins to read an entry and closes the previous one. Returns false on error, see `problem`.
  [[nodiscard]] bool open(const Entry& entry);
  /// Expands the next bytes into `into` and returns their number; fewer on error or at the end, see `problem`.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> into);
  /// Returns whether `read` returned fewer bytes because the data ended, not because it is damaged.
  [[nodiscard]] bool ran_out() const;
  /// Returns, after the whole entry was read, whether it ends there and its checksum is right.
  [[nodiscard]] bool at_good_end();

  /// Returns libzip's message about the last error.
  [[nodiscard]] std::string problem() const;
  /// Returns the offset of the present entry in the file.
  [[nodiscard]] std::uint64_t offset() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace absenc::capture
