// SPDX-License-Identifier: Apache-2.0
// A zip archive of which one thread at a time reads entries; open it once for each thread.
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
  /// `source` must outlive it. Throws OpenError, with what libzip says.
  explicit ZipArchive(Source& source);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  struct Entry {
    std::uint64_t index = 0;
    std::uint64_t size = 0;  // as the archive says: to be believed only when it was read
  };
  /// False: there is none of that name.
  [[nodiscard]] bool find(const std::string& name, Entry& entry) const;

  /// All entries, in the order of the archive.
  [[nodiscard]] std::vector<std::string> names() const;

  /// Expands a whole deflated entry into `into`, which has its size, in a quarter of the time that `open` and `read`
  /// take. True only when all of it is there and its checksum is right; else those read it as far as can be, and say
  /// what is wrong.
  [[nodiscard]] bool expand(const Entry& entry, std::span<std::uint8_t> into);

  /// Begins to read an entry; the one before is closed. False: see `trouble`.
  [[nodiscard]] bool open(const Entry& entry);
  /// Expands what comes next straight into `into`; fewer bytes: see `trouble`.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> into);
  /// Whether `read` gave fewer bytes because there are no more of them, rather than wrong ones.
  [[nodiscard]] bool ran_out() const;
  /// After the whole entry was read: whether it ends there, and its checksum is right.
  [[nodiscard]] bool at_good_end();

  /// What went wrong, in libzip's words.
  [[nodiscard]] std::string trouble() const;
  /// Where the present entry stands in the file.
  [[nodiscard]] std::uint64_t offset() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace absenc::capture
