// SPDX-License-Identifier: Apache-2.0
// Files with numbers of the C library, opened as Windows allows: what other programs may do with them meanwhile.
#pragma once

#include <windows.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// Opens the file at `path` for reading and writing. `share`: FILE_SHARE_READ and so on; `creation`: OPEN_EXISTING,
/// CREATE_NEW or OPEN_ALWAYS; `flags`: FILE_FLAG_... and FILE_ATTRIBUTE_.... Returns an empty descriptor, with errno,
/// on an error.
[[nodiscard]] Descriptor open_file(const std::string& path, DWORD share, DWORD creation,
                                   DWORD flags = FILE_ATTRIBUTE_NORMAL);

[[nodiscard]] HANDLE handle_of_file(int descriptor);

/// Writes `bytes` at offset `at`. Returns 0 or a value of errno; after an error, some of the bytes may have been
/// written.
[[nodiscard]] int write_at(int descriptor, std::uint64_t at, std::string_view bytes);

/// Reads up to `size` bytes from offset `at`; fewer at the end of the file. Throws Failure.
[[nodiscard]] std::string read_at(int descriptor, std::uint64_t at, std::size_t size, const std::string& path);

/// Sets the size of the file. Returns 0 or a value of errno.
[[nodiscard]] int set_size(int descriptor, std::uint64_t size);

/// Renames a file, and with `replaces` a file with the new name is replaced. Returns 0 or a value of errno.
[[nodiscard]] int rename_file(const std::string& from, const std::string& to, bool replaces);

/// Returns `path` with an ending that no other file has: ".4711-2", from the process and a counter.
[[nodiscard]] std::string temporary_path(const std::string& path);

}  // namespace absenc::os
