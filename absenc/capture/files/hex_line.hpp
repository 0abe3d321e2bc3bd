// SPDX-License-Identifier: Apache-2.0
// One line of hexadecimal text.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/files/text_lines.hpp"

namespace absenc::capture {

/// What a file of bytes as text is made of; see hex_text.hpp.
enum class HexForm : std::uint8_t { plain, dump, xxd, sigrok };

struct HexLine {
  std::optional<Instant> at;
  std::optional<Tick> begin;  // samples
  Tick end = 0;
  int channel = -1;  // 0: tx, 1: rx, -1: not told
  std::optional<std::uint64_t> offset;
  std::vector<std::uint8_t> bytes;
  std::string source;   // the port or whatever a terminal calls it; "": not told
  std::string trouble;  // what is wrong with it
};

/// Two digits, or more of them with a prefix: 1A, 1A00, 0x1A, \x1A, $1A. False: `bytes` is as before.
bool append_group(std::string_view group, std::vector<std::uint8_t>& bytes);

/// The line without its comment and without blanks around it.
[[nodiscard]] std::string_view strip_comment(std::string_view line);

/// The form of a file by its first line; nothing: none that is known.
[[nodiscard]] std::optional<HexForm> hex_form(std::string_view line);

/// False: the line is not of this form; `trouble` may tell why.
[[nodiscard]] bool parse_hex_line(HexForm form, std::string_view line, HexLine& parsed);

}  // namespace absenc::capture
