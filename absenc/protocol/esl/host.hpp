// SPDX-License-Identifier: Apache-2.0
// Host side of ESL: what takes more than one exchange. A single position is author::ReadPosition<Protocol>. README.md
// describes the procedures.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/esl/protocol.hpp"
#include "absenc/protocol/esl/safety.hpp"
#include "absenc/protocol/sentence.hpp"

namespace absenc::esl {

using Line = author::LineOf<Protocol>;

struct Identity {
  Reply reply{};
};
/// ID 8, preceded by an ID 5, so that eight of these in a row are not eight IDs 8 in a row.
author::Procedure read_encoder_id(Line& line, Identity& found);

struct Safe {
  Reply reply{};
  Reading reading{};
  std::optional<SafePosition> position{};  // unless every check passed: none
  Check failed = Check::sequence_unknown;
};
/// IDs 1 and 2 until the monitor trusts the line: two exchanges when all is well. Errors: those of the check that
/// failed.
author::Procedure read_safely(Line& line, Safe& found);

struct AfterReset {
  Reply reply{};
  Reading reading{};
  Sentence words{};
};
/// IDs B (single-turn zero here), C (clear alarms) and D (turns): makes sure that the shaft stands still, sends eight
/// requests, reads back what became of it. Errors: invalid_argument (the shaft turns, the encoder is not ready),
/// cross_check_failed (the encoder did not do it; the words name what remains), or that of an exchange.
author::Procedure reset(Line& line, AfterReset& found, DataId id);

// ---- Memory (Tables 9 to 11, Figures 14 and 15). One-to-one only

struct MemoryBytes {
  std::uint8_t page = 0;
  std::uint8_t address = 0;
  ByteBuffer<last_address + 1> data{};
};
/// Arguments: address, page, count. Errors: invalid_argument (not in Table 11), busy.
author::Procedure read_memory(Line& line, MemoryBytes& found, Arguments arguments);

struct Written {
  std::uint8_t page = 0;
  std::uint8_t address = 0;
  std::uint8_t value = 0;
  bool sent = false;  // false: the byte held the value already
  Sentence words{};
};
/// Reads, writes what differs, waits, reads back. Arguments: address, value, page, force. Errors: invalid_argument (not
/// in Table 11, or not without force), busy, cross_check_failed (another value is there now).
author::Procedure write_memory(Line& line, Written& found, Arguments arguments);

struct Selected {
  std::uint8_t page = 0;
};
/// For whoever reads or writes by himself. Arguments: page.
author::Procedure select_page(Line& line, Selected& found, Arguments arguments);

struct ErrorInfo {
  std::uint8_t flags = 0;
  bool page_left = false;  // page 8 stays selected: which one was before is not known
};
/// Page 8 address 1A: which of the two is behind led_or_lissajous_error. The page before is selected again.
author::Procedure read_error_info(Line& line, ErrorInfo& found);

// ---- Several encoders on one line

inline constexpr unsigned most_encoders = 8;  // 3 address bits

struct Nodes {
  std::array<std::optional<Reply>, most_encoders> answers{};  // the last good reply of each
  std::array<bool, most_encoders> disturbed{};
};
/// Asks every address for ID 5, never for ID 8: eight of these in a row are "dynamic addressing". An answer that is
/// damaged every time tells of two encoders with one address, or of a bad line. Error: timeout when nobody answers.
author::Procedure scan(Line& line, Nodes& found);

}  // namespace absenc::esl
