// SPDX-License-Identifier: Apache-2.0
// Reader for levels as comma-separated values, with a column for each channel and a row for each change or sample.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns true if a file that begins with `head` is meant for `read_logic_csv`.
[[nodiscard]] bool is_logic_csv(std::string_view head);

/// Reads the files of these programs, with a level of 0, 1 or X in each column of a channel:
///
/// - Saleae Logic 2: a first line `Time [s],NAME,NAME...`, then rows with the time in seconds (also with an exponent,
///   or negative) or as ISO 8601. Ticks are picoseconds from the first row on.
/// - sigrok: comment lines with `;`, then a line with the kind of each column (`logic`, and a first column with the
///   unit of its times: `seconds` to `picoseconds`), then rows. Without times each row is a sample, at the rate in the
///   comment or `samples_per_second`. Columns of other kinds (analog) are left out, with a note.
///
/// X leaves the level unchanged, with a note. An invalid row, or a time before that of the previous row, is a damage:
/// the rows before it are valid. Throws OpenError if the first lines are invalid.
[[nodiscard]] std::unique_ptr<Reader> read_logic_csv(std::unique_ptr<Source> source, std::string_view name,
                                                     std::uint64_t samples_per_second);

}  // namespace absenc::capture
