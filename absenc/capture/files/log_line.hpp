// SPDX-License-Identifier: Apache-2.0
// One line of bytes as people type it and terminal programs log it.
#pragma once

#include <string_view>

#include "absenc/capture/files/hex_line.hpp"

namespace absenc::capture {

/// Before the bytes, in any order, each also in `[]` or `()`, with a colon behind, apart by blanks, `,`, `;`, `|` or `
/// - `:
///
/// - a time: seconds with a point (`12.000250`), a number with a unit (`250us`; s, ms, us, ns), or a clock
///   (`17:55:24.123`, `17:55:24,123`, `5:55:24 PM`), perhaps with a date (ISO 8601, `2026/11/21`, `21.11.2026`,
///   `11/21/2026`);
/// - a direction: `tx`, `out`, `host`, `sent`, `write` ..., `>`, `>>`, `->`, `-->` and `rx`, `in`, `device`,
/// `received`,
///   `read` ..., `<`, `<<`, `<-`, `<--`, in any case, the arrows also behind a port (`COM3>`);
/// - a port (`COM3`, `ttyUSB0`, `/dev/ttyS1`), or any other name with a colon behind or in brackets: `source`;
/// - numbers of lines and lengths (`12:`, `[11]`, `11 bytes`, `len=11`), which do not count.
///
/// The bytes are groups as `append_group` takes them, apart by blanks, commas or semicolons, or single ones with `:` or
/// `-` between. Behind them may stand their text, which must be theirs: printable bytes as they are, others as a dot
/// or the like.
///
/// False where that is not so, or could be read in two ways: `trouble` says what.
bool parse_log_line(std::string_view line, HexLine& parsed);

}  // namespace absenc::capture
