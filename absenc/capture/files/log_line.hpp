// SPDX-License-Identifier: Apache-2.0
// Parses one line of bytes as people type it and terminal programs log it.
#pragma once

#include <string_view>

#include "absenc/capture/files/hex_line.hpp"

namespace absenc::capture {

/// Parses a line into `parsed`. Before the bytes these items may occur in any order:
///
/// - a time, like `12.000250` (seconds), `250us`, `17:55:24.123` or `2026-11-21T17:55:24Z`;
/// - a direction, like `tx`, `sent`, `>` and `rx`, `received`, `<`;
/// - a port, like `COM3` or `/dev/ttyS1`;
/// - line numbers and lengths, like `12:` or `11 bytes`, which are ignored.
///
/// The bytes are groups as in `append_group`, or single bytes separated by `:` or `-`; their text may follow. Returns
/// false if the line is invalid or ambiguous; `parsed.problem` then contains the reason.
bool parse_log_line(std::string_view line, HexLine& parsed);

}  // namespace absenc::capture
