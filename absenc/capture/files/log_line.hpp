// SPDX-License-Identifier: Apache-2.0
// Parses one line of bytes as people type it and terminal programs log it.
#pragma once

#include <string_view>

#include "absenc/capture/files/hex_line.hpp"

namespace absenc::capture {

/// Parses a line into `parsed`. Before the bytes these items may occur in any order, each also in `[]` or `()` or with
/// a colon behind it, separated by blanks, `,`, `;`, `|` or ` - `:
///
/// - a time: seconds with a point (`12.000250`), a number with a unit (`250us`; s, ms, us, ns), or a clock time
///   (`17:55:24.123`, `17:55:24,123`, `5:55:24 PM`), optionally with a date (ISO 8601, `2026/11/21`, `21.11.2026`,
///   `11/21/2026`);
/// - a direction: `tx`, `out`, `host`, `sent`, `write` ..., `>`, `>>`, `->`, `-->` and `rx`, `in`, `device`,
///   `received`, `read` ..., `<`, `<<`, `<-`, `<--`, in upper or lower case, the arrows also behind a port (`COM3>`);
/// - a port (`COM3`, `ttyUSB0`, `/dev/ttyS1`), or any other name with a colon behind it or in brackets: `source`;
/// - line numbers and lengths (`12:`, `[11]`, `11 bytes`, `len=11`), which are ignored.
///
/// The bytes are groups as in `append_group`, separated by blanks, commas or semicolons, or single bytes separated by
/// `:` or `-`. The text of the bytes may follow, and must match them: printable bytes as they are, others as a dot or a
/// similar character.
///
/// Returns false if the line is invalid or ambiguous; `parsed.problem` then contains the reason.
bool parse_log_line(std::string_view line, HexLine& parsed);

}  // namespace absenc::capture
