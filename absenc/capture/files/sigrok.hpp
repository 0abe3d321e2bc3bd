// SPDX-License-Identifier: Apache-2.0
// Reader for sessions of sigrok (.sr): a zip archive of `version`, `metadata` and the samples, in one or many pieces.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns true if a file that begins with `head` is a zip archive.
[[nodiscard]] bool is_zip(std::string_view head);

/// Reads sessions of versions 1 and 2 with up to 64 logic channels; analog channels are left out, with a note. Without
/// a rate in the file, `samples_per_second` is used. Throws OpenError if the session cannot be read or has no logic
/// samples.
///
/// - A piece of up to 16 MiB is one block, expanded by `fill`; a larger one is expanded by `claim`, 4 MiB at a time.
/// - A damaged piece is an empty block, because it is unknown which of its samples are wrong (a larger piece ends where
///   the damage shows); later pieces are valid. The damage has the offset of the piece in the file.
/// - If the file is cut off, everything before the cut is read; the damage has the offset and the tick of the cut. The
///   remaining part of the cut piece is used if it can be expanded, although its checksum cannot be verified.
[[nodiscard]] std::unique_ptr<Reader> read_sigrok(std::unique_ptr<Source> source, std::string_view name,
                                                  std::uint64_t samples_per_second);

}  // namespace absenc::capture
