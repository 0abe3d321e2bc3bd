// SPDX-License-Identifier: Apache-2.0
// Sessions of sigrok (.sr): a zip archive of `version`, `metadata` and the samples, in one piece or in many.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// True when a file that begins so is a zip archive.
[[nodiscard]] bool is_zip(std::string_view head);

/// Versions 1 and 2, up to 64 logic channels; analog ones are left out, with a note. A piece of up to 16 MiB is a
/// block, expanded by `fill`; a larger one is expanded by `claim`, 4 MiB at a time. A damaged piece is an empty block,
/// because nobody knows which of its samples are wrong (a larger one ends where that shows); the pieces behind it
/// count. The offset of a damage is that of the piece. Of a file that is cut off, what stands before the cut is read; a
/// damage has the offset and the tick of the cut. What is left of the piece there counts, though its checksum cannot be
/// verified, unless it does not expand. Without a rate in the file, `samples_per_second` is used. Throws OpenError when
/// there are no samples to be had.
[[nodiscard]] std::unique_ptr<Reader> read_sigrok(std::unique_ptr<Source> source, std::string_view name,
                                                  std::uint64_t samples_per_second);

}  // namespace absenc::capture
