// SPDX-License-Identifier: Apache-2.0
// Repairs a zip archive that lost the directory at its end, because the file is cut off.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "absenc/capture/files/source.hpp"

namespace absenc::capture {

struct MendedZip {
  std::unique_ptr<Source> archive;         // the part of the archive that remains, followed by a new directory
  std::uint64_t end = 0;                   // offset in the file of the end of the last entry, which may be cut off
  bool complete = false;                   // true: the damaged directory begins at `end`, so no entry is missing
  std::optional<std::uint64_t> cut_entry;  // index of the last entry if the file ends within this entry
};

/// Builds a new directory of a zip archive from the local headers of its entries, up to the first that cannot be used.
/// The directory takes about 64 MiB at most.
[[nodiscard]] MendedZip mend_zip(std::unique_ptr<Source> source);

}  // namespace absenc::capture
