// SPDX-License-Identifier: Apache-2.0
// Parsing of one line of hexadecimal text.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/files/text_lines.hpp"

namespace absenc::capture {

/// Form of a text file with bytes; see hex_text.hpp.
enum class HexForm : std::uint8_t { plain, dump, xxd, sigrok };

struct HexLine {
  std::optional<Instant> at;
  std::optional<Tick> begin;  // first sample of the annotation, for sigrok
  Tick end = 0;
  int channel = -1;  // 0: tx, 1: rx, -1: no direction
  std::optional<std::uint64_t> offset;
  std::vector<std::uint8_t> bytes;
  std::string source;   // name of the port in a terminal log; "": none
  std::string problem;  // reason why the line is invalid
};

/// Parses a group: two digits, or more with a prefix: 1A, 1A00, 0x1A, \x1A, $1A. Returns false and leaves `bytes` if it
/// is invalid.
bool append_group(std::string_view group, std::vector<std::uint8_t>& bytes);

/// Returns the line without its comment and without blanks around it.
[[nodiscard]] std::string_view strip_comment(std::string_view line);

/// Returns the form of a file, found from its first line; nothing if the form is unknown.
[[nodiscard]] std::optional<HexForm> hex_form(std::string_view line);

/// Parses a line. Returns false if it does not have this form; `problem` may contain the reason.
[[nodiscard]] bool parse_hex_line(HexForm form, std::string_view line, HexLine& parsed);

}  // namespace absenc::capture
