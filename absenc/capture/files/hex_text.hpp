// SPDX-License-Identifier: Apache-2.0
// Reader for bytes as hexadecimal text: typed, dumped or logged.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns whether the first line of `head` with content has a form that `read_hex_text` reads.
[[nodiscard]] bool is_hex_text(std::string_view head);

/// Returns why the first line of `head` with content is neither typed nor logged bytes; "" if it is, or if no reason is
/// known.
[[nodiscard]] std::string hex_text_problem(std::string_view head);

/// Reads lines of one of these forms; the first line with content decides which. HEX is bytes as in `append_group`.
///
/// - Lines that people type and terminal programs log, see log_line.hpp. All lines must be of one port.
/// - Dumps of `hexdump -C`, `od -A x -t x1` and `xxd`.
/// - `sigrok-cli -P uart`: `[BEGIN-END ]uart-1: [CLASS: ]HEX`.
///
/// Channels are "tx" and "rx" if there are directions. Ticks are nanoseconds from the first line on; with BEGIN-END
/// they are samples, `samples_per_second` per second. Without times each byte takes one tick. Throws OpenError.
[[nodiscard]] std::unique_ptr<Reader> read_hex_text(std::unique_ptr<Source> source, std::string_view name,
                                                    std::uint64_t samples_per_second);

}  // namespace absenc::capture
