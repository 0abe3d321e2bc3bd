// SPDX-License-Identifier: Apache-2.0
// Reader for levels as comma-separated values, with a row for each change or sample.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns whether a file that begins with `head` has the form of a file for `read_logic_csv`.
[[nodiscard]] bool is_logic_csv(std::string_view head);

/// Reads the files of these programs, with a level of 0, 1 or X (unchanged) in each column of a channel:
///
/// - Saleae Logic 2: a first line `Time [s],NAME,NAME...`, then rows with the time in seconds or as ISO 8601. Ticks are
/// picoseconds from the first row on.
/// - sigrok: comment lines with `;`, a line with the kind of each column, then rows. Without times each row is a
/// sample, at the rate in the comment or `samples_per_second`.
///
/// Throws OpenError.
[[nodiscard]] std::unique_ptr<Reader> read_logic_csv(std::unique_ptr<Source> source, std::string_view name,
                                                     std::uint64_t samples_per_second);

}  // namespace absenc::capture
