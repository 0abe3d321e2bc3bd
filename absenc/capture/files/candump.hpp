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
  enum class Kind : std::uint8_t { frame, other_can };  // other_can: a frame of CAN FD or CAN XL
  Kind kind = Kind::frame;
  bool timed = false;
  Instant at;
  std::string_view channel;
  CanRecord record;
};

[[nodiscard]] bool parse_candump(std::string_view line, CandumpLine& parsed);

/// Reads lines of these forms, either all with a time in parentheses or all without:
///
///     (1436509052.249713) vcan0 044#2A366C2B            candump -l and -L; #R or #R4: remote; bytes also with points
///      (000.001021)  can0  RX - -  12345678   [3]  1A 00 35   '..5'     to the screen, with -t a, A, d or z, -x, -a
///
/// Ticks are nanoseconds from the first frame on; without times all are 0. Channels are the interfaces that the
/// beginning of the file names. Throws OpenError.
[[nodiscard]] std::unique_ptr<Reader> read_candump(std::unique_ptr<Source> source, std::string_view name);

}  // namespace absenc::capture
