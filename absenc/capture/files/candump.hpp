// SPDX-License-Identifier: Apache-2.0
// What candump of can-utils prints, to a log file or to the screen.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/files/text_lines.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// What a line holds.
struct CandumpLine {
  enum class Kind : std::uint8_t { frame, other_can };  // other: CAN FD or XL
  Kind kind = Kind::frame;
  bool timed = false;
  Instant at;
  std::string_view channel;
  CanRecord record;
};

/// False: the line is none of candump's.
[[nodiscard]] bool parse_candump(std::string_view line, CandumpLine& parsed);

/// Reads lines of these forms, each with a time in parentheses or all without:
///
///     (1436509052.249713) vcan0 044#2A366C2B            candump -l and -L; #R or #R4: remote; bytes also with points
///      (000.001021)  can0  RX - -  12345678   [3]  1A 00 35   '..5'     to the screen, with -t a, A, d or z, -x, -a
///
/// An identifier of three digits is a standard one, of eight an extended one, or with bit 29 an error frame. Ticks are
/// nanoseconds from the first frame on; without times all are 0. Times that do not rise in the first 64 KiB, but are
/// less than a day, are those of -t d, each from the frame before. Channels are the interfaces named in the first
/// 64 KiB; frames of others, and those of CAN FD and CAN XL, are left out, with a note. A line that is none of these,
/// or a time before the one above it, is a damage: what precedes it counts.
[[nodiscard]] std::unique_ptr<Reader> read_candump(std::unique_ptr<Source> source, std::string_view name);

}  // namespace absenc::capture
