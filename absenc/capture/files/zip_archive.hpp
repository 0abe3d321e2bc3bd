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
  /// Opens the archive in `source`, which must outlive the archive. Throws OpenError with libzip's message.
  explicit ZipArchive(Source& source);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  struct Entry {
    std::uint64_t index = 0;
    // Size of the expanded entry according to the directory; reliable only after the entry was read.
    std::uint64_t size = 0;
  };
  /// Finds an entry by its name and describes it in `entry`. Returns false if the archive has no such entry.
  [[nodiscard]] bool find(const std::string& name, Entry& entry) const;

  /// Returns the names of all entries, in the order of the archive.
  [[nodiscard]] std::vector<std::string> names() const;

  /// Expands a whole deflated entry into `into`, which must have the entry's size, faster than `open` and `read`.
  /// Returns true only if the entry is deflated, complete and its checksum is right; otherwise `open` and `read` return
  /// as much as possible and report the error, if there is one.
  [[nodiscard]] bool expand(const Entry& entry, std::span<std::uint8_t> into);

  /// Begins to read an entry and closes the previous entry. Returns false on error; `problem` then returns the reason.
  [[nodiscard]] bool open(const Entry& entry);
  /// Expands the next bytes of the open entry into `into` and returns their number; fewer on error or at the end of the
  /// entry, see `problem`.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> into);
  /// Returns whether `read` returned fewer bytes because the entry's data ended, even if its checksum or size is wrong;
  /// false if the data is damaged otherwise.
  [[nodiscard]] bool ran_out() const;
  /// Returns, after the whole entry was read, whether the entry ends there and its checksum is right.
  [[nodiscard]] bool at_good_end();

  /// Returns a message about the last error of this archive, mostly libzip's.
  [[nodiscard]] std::string problem() const;
  /// Returns the offset in the file of the entry that `open` opened last.
  [[nodiscard]] std::uint64_t offset() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace absenc::capture
