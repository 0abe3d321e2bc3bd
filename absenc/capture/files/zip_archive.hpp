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

/// Returns whether this program can read and write archives: it was built with the libraries for them.
[[nodiscard]] bool has_zip();

class ZipArchive {
 public:
  /// Opens the archive in `source`, which must outlive this object. Throws OpenError.
  explicit ZipArchive(Source& source);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  struct Entry {
    std::uint64_t index = 0;
    // size of the expanded entry that the directory states; it may be wrong
    std::uint64_t size = 0;
  };
  /// Finds an entry by its name; returns false if there is none.
  [[nodiscard]] bool find(const std::string& name, Entry& entry) const;

  /// Returns the names of all entries, in the order of the archive.
  [[nodiscard]] std::vector<std::string> names() const;

  /// Expands an intact deflated entry into `into`. Returns false if that fails, or if the entry is not deflated.
  [[nodiscard]] bool expand(const Entry& entry, std::span<std::uint8_t> into);

  /// Begins to read an entry instead of the previous one; returns false on error, see `problem`.
  [[nodiscard]] bool open(const Entry& entry);
  /// Expands the next bytes of the open entry; returns their number, fewer at its end or on error.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> into);
  /// Returns whether the last `read` returned fewer bytes because the entry's data ended.
  [[nodiscard]] bool ran_out() const;
  /// Returns whether the entry that was read ends here, and its checksum is right.
  [[nodiscard]] bool at_good_end();

  /// Returns a message about the last error of this archive.
  [[nodiscard]] std::string problem() const;
  /// Returns the offset in the file of the entry that `open` opened last.
  [[nodiscard]] std::uint64_t offset() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace absenc::capture
