// SPDX-License-Identifier: Apache-2.0
// Reader for the output of candump (can-utils), to a log file or to the screen.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/files/text_lines.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Content of one line of candump's output.
struct CandumpLine {
  enum class Kind : std::uint8_t { frame, other_can };  // other_can: CAN FD or XL
  Kind kind = Kind::frame;
  bool timed = false;
  Instant at;
  std::string_view channel;
  CanRecord record;
};

/// Parses one line of candump's output into `parsed`. Returns false if the line has another form.
[[nodiscard]] bool parse_candump(std::string_view line, CandumpLine& parsed);

/// Reads lines of these forms, either all with a time in parentheses or all without:
///
///     (1436509052.249713) vcan0 044#2A366C2B            candump -l and -L; #R or #R4: remote; bytes also with points
///      (000.001021)  can0  RX - -  12345678   [3]  1A 00 35   '..5'     to the screen, with -t a, A, d or z, -x, -a
///
/// An identifier of three digits is a standard one, of eight digits an extended one, or with bit 29 an error frame.
/// Ticks are nanoseconds from the first frame on; without times all are 0. If a time in the first 64 KiB, other than 0
/// and less than a day, is before the time before it, or equal to it on the same interface, all times are those of -t
/// d: each is the time since the previous frame. Channels are the interfaces named in the first 64 KiB; frames of other
/// interfaces, and those of CAN FD and CAN XL, are left out, with a note. A line of another form, or a time before that
/// of the previous line, is a damage: the lines before it are valid. Blank lines are skipped. Throws OpenError if there
/// is no other line, or the first of them has another form.
[[nodiscard]] std::unique_ptr<Reader> read_candump(std::unique_ptr<Source> source, std::string_view name);

}  // namespace absenc::capture
