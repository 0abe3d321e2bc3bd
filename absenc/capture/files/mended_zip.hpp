// SPDX-License-Identifier: Apache-2.0
// A zip archive that has lost the directory at its end, because the file is cut off.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "absenc/capture/files/source.hpp"

namespace absenc::capture {

struct MendedZip {
  std::unique_ptr<Source> archive;         // what is there of it, and behind that a directory
  std::uint64_t end = 0;                   // where the last entry ends that is there
  bool complete = false;                   // the lost directory begins there: no entry is missing
  std::optional<std::uint64_t> cut_entry;  // index of the last one, when the file ends within it
};

/// Makes a directory of the headers in front of the entries. It ends before an entry whose size stands behind it, which
/// no writer of sessions does. Memory grows with the number of entries, up to 64 MiB (700'000 pieces of a session);
/// what is behind them counts as missing.
[[nodiscard]] MendedZip mend_zip(std::unique_ptr<Source> source);

}  // namespace absenc::capture
