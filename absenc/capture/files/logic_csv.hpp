// SPDX-License-Identifier: Apache-2.0
// Levels as comma-separated values, a column for each channel and a row for each change or each sample.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// True when a file that begins so is meant for `read_logic_csv`.
[[nodiscard]] bool is_logic_csv(std::string_view head);

/// Reads, with a level of 0, 1 or X in each column of a channel:
///
/// - Saleae Logic 2: a first line `Time [s],NAME,NAME...`, then rows with the time in seconds (also with an exponent,
/// or
///   negative) or as ISO 8601. Ticks are picoseconds from the first row on.
/// - sigrok: lines of comment with `;`, then a line with the kind of each column (`logic`, with a first column that
/// names
///   its unit of time: `seconds` to `picoseconds`), then rows. Without times each row is a sample, at the rate of the
///   comment or of `samples_per_second`. Columns of other kinds (analog) are left out, with a note.
///
/// X keeps the level before, with a note. A row that is not such a row, or a time before the one above it, is a damage:
/// what precedes it counts. Throws OpenError when the first lines make no sense.
[[nodiscard]] std::unique_ptr<Reader> read_logic_csv(std::unique_ptr<Source> source, std::string_view name,
                                                     std::uint64_t samples_per_second);

}  // namespace absenc::capture
