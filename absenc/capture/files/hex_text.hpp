// SPDX-License-Identifier: Apache-2.0
// Bytes as hexadecimal text: typed by a person, dumped by a tool, or logged by a terminal program or a decoder.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// True when the first line that is not empty and no comment is one that `read_hex_text` reads.
[[nodiscard]] bool is_hex_text(std::string_view head);

/// What stands in the way in the first line that counts; "" when nothing does.
[[nodiscard]] std::string hex_text_trouble(std::string_view head);

/// Reads lines of one of these forms; the first line decides which. Empty lines, and what stands behind `#` or `//`, do
/// not count. HEX is any number of bytes: pairs of digits, together or apart by blanks, commas or semicolons, each
/// group perhaps with `0x`, `\x` or `$` before it; `0x` alone also before a single digit.
///
/// - what people type and terminal programs log, log_line.hpp: a time, a port and a direction in any order, the bytes,
///   and their text. All lines are of one port.
/// - dumps of `hexdump -C`, `od -A x -t x1` and `xxd`: an offset, bytes (of xxd also in groups), then text. That
/// offsets
///   jump is noted once. A `*` for repeated lines is a damage: write the dump with -v.
/// - `sigrok-cli -P uart`: `[BEGIN-END ]uart-1: [CLASS: ]HEX`. Of the classes only `rx-data` and `tx-data` count; of
///   lines without a class those of two digits.
///
/// Channels are "tx" and "rx" if there are directions. Ticks are nanoseconds from the first line on, and all bytes of a
/// line have its time; with BEGIN-END they are samples, `samples_per_second` of them a second. Without times each byte
/// is a tick. A line of another form, or a time before the one above it, is a damage: what precedes it counts.
[[nodiscard]] std::unique_ptr<Reader> read_hex_text(std::unique_ptr<Source> source, std::string_view name,
                                                    std::uint64_t samples_per_second);

}  // namespace absenc::capture
