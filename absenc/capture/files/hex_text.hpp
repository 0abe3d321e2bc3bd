// SPDX-License-Identifier: Apache-2.0
// Reader for bytes as hexadecimal text: typed by a person, dumped by a tool, or logged by a terminal program or a
// decoder.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns true if the first line that is not empty and not a comment can be read by `read_hex_text`.
[[nodiscard]] bool is_hex_text(std::string_view head);

/// Returns the reason why the first line with content cannot be read in the form that people type and terminal programs
/// log; "" if it can, or if no reason is known.
[[nodiscard]] std::string hex_text_problem(std::string_view head);

/// Reads lines of one of the forms below; the first line decides which. Empty lines and, except in dumps, text behind
/// `#` or `//` are ignored. HEX is any number of bytes: pairs of digits, adjacent or separated by blanks, commas or
/// semicolons, each group optionally with `0x`, `\x` or `$` before it, in which case a single digit is allowed too.
///
/// - Lines that people type and terminal programs log, see log_line.hpp: a time, a port and a direction in any order,
///   the bytes, and their text. All lines must be of one port.
/// - Dumps of `hexdump -C`, `od -A x -t x1` and `xxd`: an offset, bytes (of xxd also in groups), then text. Jumping
///   offsets are noted once. A `*` for repeated lines is a damage: write the dump with `hexdump -v`, `od -v` or `xxd`
///   without -a.
/// - `sigrok-cli -P uart`: `[BEGIN-END ]uart-1: [CLASS: ]HEX`. Lines of the classes `rx-data` and `tx-data` are read,
///   and lines without a class that have two digits.
///
/// Channels are "tx" and "rx" if there are directions. Ticks are nanoseconds from the first line on, and all bytes of a
/// line have its time; with BEGIN-END they are samples, `samples_per_second` per second. Without times each byte takes
/// one tick. A line of another form, one that lacks or adds a time, port or direction, or a time before that of the
/// previous line, is a damage: the lines before it are valid. Throws OpenError if the first line has none of the forms.
[[nodiscard]] std::unique_ptr<Reader> read_hex_text(std::unique_ptr<Source> source, std::string_view name,
                                                    std::uint64_t samples_per_second);

}  // namespace absenc::capture
