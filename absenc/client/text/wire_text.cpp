// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/wire_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "absenc/client/error.hpp"
#include "absenc/core/hex.hpp"

namespace absenc::client {

namespace {

bool separates(char c) { return c == ' ' || c == ',' || c == '\t' || c == '\n' || c == '\r'; }

std::string shown(char c) {
  const bool printable = c >= 0x20 && c < 0x7F;
  return printable ? fmt::format("'{}'", c) : fmt::format("the byte 0x{:02X}", static_cast<unsigned char>(c));
}

[[noreturn]] void refuse_frame(std::string_view what, std::string_view text, std::size_t at, std::string_view wanted) {
  throw UsageError(fmt::format("{}: {} at position {} is not {}", what, shown(text[at]), at + 1, wanted));
}

// Parses bytes in hexadecimal, which begin at the index `from` of `text`.
std::vector<std::uint8_t> parse_bytes(std::string_view what, std::string_view text, std::size_t from) {
  std::vector<std::uint8_t> bytes;
  bool inside = false;  // whether the present character is inside a run of hexadecimal digits, where 0x is an error
  for (std::size_t i = from; i < text.size();) {
    if (separates(text[i])) {
      inside = false;
      ++i;
      continue;
    }
    const bool prefixed = text[i] == '0' && i + 1 < text.size() && (text[i + 1] == 'x' || text[i + 1] == 'X');
    if (prefixed && !inside) {
      inside = true;
      i += 2;
      if (i == text.size() || separates(text[i])) {
        throw UsageError(fmt::format("{}: no digits follow the 0x at position {}", what, i - 1));
      }
      continue;
    }
    const int high = hex_digit(text[i]);
    if (high < 0) refuse_frame(what, text, i, "a hexadecimal digit");
    if (i + 1 == text.size() || separates(text[i + 1])) {
      throw UsageError(
          fmt::format("{}: the byte at position {} has one digit, but bytes have two (0{})", what, i + 1, text[i]));
    }
    const int low = hex_digit(text[i + 1]);
    if (low < 0) refuse_frame(what, text, i + 1, "a hexadecimal digit");
    bytes.push_back(static_cast<std::uint8_t>(high << 4 | low));
    inside = true;
    i += 2;
  }
  return bytes;
}

CanFrame parse_can(std::string_view what, std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos || colon == 0) {
    throw UsageError(fmt::format("{}: \"{}\" is no CAN frame: write ID:DATA, as in 1FF:022B000000000000", what, text));
  }
  CanFrame frame;
  for (std::size_t i = 0; i < colon; ++i) {
    const int digit = hex_digit(text[i]);
    if (digit < 0) refuse_frame(what, text, i, "a hexadecimal digit");
    frame.id = frame.id << 4 | static_cast<std::uint32_t>(digit);
  }
  frame.extended = colon > 3;
  if (colon > 8 || frame.id > (frame.extended ? 0x1FFFFFFFu : 0x7FFu)) {
    throw UsageError(fmt::format("{}: {} is no CAN identifier: 11 bits (000 to 7FF) or, with more digits, 29 bits",
                                 what, text.substr(0, colon)));
  }
  const std::string_view content = text.substr(colon + 1);
  if (content.size() == 2 && (content[0] == 'R' || content[0] == 'r') && content[1] >= '0' && content[1] <= '8') {
    frame.remote = true;
    frame.size = static_cast<std::uint8_t>(content[1] - '0');
    return frame;
  }
  const std::vector<std::uint8_t> data = parse_bytes(what, text, colon + 1);
  if (data.size() > frame.data.size()) {
    throw UsageError(fmt::format("{}: a CAN frame carries at most 8 bytes, not {}", what, data.size()));
  }
  frame.size = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data.begin());
  return frame;
}

void parse_bits(std::string_view what, std::string_view text, WireFrame& frame) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (separates(text[i])) continue;
    if (text[i] != '0' && text[i] != '1') refuse_frame(what, text, i, "a bit: this wire carries a string of 0 and 1");
    if (frame.bits % 8 == 0) frame.bytes.push_back(0);
    if (text[i] == '1') frame.bytes.back() |= static_cast<std::uint8_t>(0x80u >> frame.bits % 8);
    ++frame.bits;
  }
}

// Leaves out the data of a remote frame, which has only a length.
std::string can_text(const CanFrame& frame) {
  const std::string data =
      frame.remote ? fmt::format("R{}", frame.size) : fmt::format("{:02X}", fmt::join(frame.bytes(), ""));
  return fmt::format("{:0{}X}:{}", frame.id, frame.extended ? 8 : 3, data);
}

// Prints bits, with a space after every `group` bits; 0: no spaces.
std::string bits_text(const Frame& frame, std::size_t group) {
  std::string text;
  for (std::size_t i = 0; i < frame.bits; ++i) {
    if (group != 0 && i != 0 && i % group == 0) text += ' ';
    text += (frame.bytes[i / 8] >> (7 - i % 8) & 1) != 0 ? '1' : '0';
  }
  return text;
}

}  // namespace

Frame WireFrame::frame() const { return {bytes, bits, can ? &*can : nullptr}; }

WireFrame parse_wire_text(LinkKind link, std::string_view what, std::string_view text) {
  WireFrame frame;
  switch (link) {
    case LinkKind::can:
      frame.can = parse_can(what, text);
      break;
    case LinkKind::clocked:
    case LinkKind::clocked_bidirectional:
      parse_bits(what, text, frame);
      break;
    default:
      frame.bytes = parse_bytes(what, text, 0);
      break;
  }
  return frame;
}

std::string to_hex(Bytes bytes) { return fmt::format("{:02X}", fmt::join(bytes, " ")); }

std::string to_wire_text(LinkKind link, const Frame& frame) {
  if (frame.can != nullptr) return can_text(*frame.can);
  return carries_bits(link) ? bits_text(frame, 4) : to_hex(frame.bytes);
}

std::string to_compact_wire_text(LinkKind link, const Frame& frame) {
  if (frame.can != nullptr) {
    std::string text = can_text(*frame.can);
    std::transform(text.begin(), text.end(), text.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c | 0x20) : c; });
    return text;
  }
  return carries_bits(link) ? bits_text(frame, 0) : fmt::format("{:02x}", fmt::join(frame.bytes, ""));
}

}  // namespace absenc::client
