// SPDX-License-Identifier: Apache-2.0
// Reader for sessions of sigrok (.sr), which are zip archives.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns true if a file that begins with `head` is a zip archive.
[[nodiscard]] bool is_zip(std::string_view head);

/// Reads sessions of versions 1 and 2 with up to 64 logic channels. Without a rate in the file, `samples_per_second` is
/// used. The samples of a damaged archive entry are left out, all or in part; later samples keep their times. Throws
/// OpenError.
[[nodiscard]] std::unique_ptr<Reader> read_sigrok(std::unique_ptr<Source> source, std::string_view name,
                                                  std::uint64_t samples_per_second);

}  // namespace absenc::capture
