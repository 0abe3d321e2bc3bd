// SPDX-License-Identifier: Apache-2.0
// Parses one line of hexadecimal text that is typed, dumped or written by a decoder.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/files/text_lines.hpp"

namespace absenc::capture {

/// The forms of text files that contain bytes; see hex_text.hpp.
enum class HexForm : std::uint8_t { plain, dump, xxd, sigrok };

struct HexLine {
  std::optional<Instant> at;
  std::optional<Tick> begin;  // in the form of sigrok: index of the first sample of the bytes, if the line states it
  Tick end = 0;
  int channel = -1;  // direction of the bytes: 0 is tx, 1 is rx, -1 means that the line states none
  std::optional<std::uint64_t> offset;
  std::vector<std::uint8_t> bytes;
  std::string source;   // source that a log line names, such as a port; "": none
  std::string problem;  // reason why the line is invalid, as words; "" if no reason is known
};

/// Appends the bytes of a group of hexadecimal digits, like 1A, 1A00, 0x1A, \x1A or $1A. Returns false and leaves
/// `bytes` unchanged if the group is invalid.
bool append_group(std::string_view group, std::vector<std::uint8_t>& bytes);

/// Returns `line` without its comment and without blanks around the rest.
[[nodiscard]] std::string_view strip_comment(std::string_view line);

/// Returns the form of a file whose first line is `line`; nothing if the form is unknown.
[[nodiscard]] std::optional<HexForm> hex_form(std::string_view line);

/// Parses a line of the given form; returns false, perhaps with `parsed.problem`, if that fails.
[[nodiscard]] bool parse_hex_line(HexForm form, std::string_view line, HexLine& parsed);

}  // namespace absenc::capture
