// SPDX-License-Identifier: Apache-2.0
// Host side of ESL: what takes more than one exchange. A single position is author::ReadPosition<Protocol>. README.md
// describes the procedures.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/sentence.hpp"

namespace absenc::esl {

using Dialog = author::DialogOf<Protocol>;

/// What a procedure found.
struct Found : Shown {
  Reading reading{};
  ByteBuffer<last_address + 1> bytes{};  // of `data`
  Sentence words{};                      // of the error
};

/// ID 8, preceded by an ID 5, so that eight of these in a row are not eight IDs 8 in a row.
author::Procedure read_encoder_id(Dialog& dialog, Found& found);

/// IDs 1 and 2 until the monitor trusts the line: two exchanges when all is well. Errors: those of the check that
/// failed.
author::Procedure read_safely(Dialog& dialog, Found& found);

/// IDs B (single-turn zero here), C (clear alarms) and D (turns): makes sure that the shaft stands still, sends eight
/// requests, reads back what became of it. Errors: invalid_argument (the shaft turns, the encoder is not ready),
/// cross_check_failed (the encoder did not do it; the words name what remains), or that of an exchange.
author::Procedure reset(Dialog& dialog, Found& found, DataId id);

// ---- Memory (Tables 9 to 11, Figures 14 and 15). One-to-one only

/// Arguments: address, page, count. Errors: invalid_argument (not in Table 11), busy.
author::Procedure read_memory(Dialog& dialog, Found& found, Arguments arguments);

/// Reads, writes what differs, waits, reads back. Arguments: address, value, page, force. Errors: invalid_argument (not
/// in Table 11, or not without force), busy, cross_check_failed (another value is there now).
author::Procedure write_memory(Dialog& dialog, Found& found, Arguments arguments);

/// For whoever reads or writes by himself. Arguments: page.
author::Procedure select_page(Dialog& dialog, Found& found, Arguments arguments);

/// Page 8 address 1A: which of the two is behind led_or_lissajous_error. The page before is selected again.
author::Procedure read_error_info(Dialog& dialog, Found& found);

// ---- Several encoders on one line

inline constexpr unsigned most_encoders = 8;  // 3 address bits

struct Nodes {
  std::array<std::optional<Reply>, most_encoders> answers{};  // the last good reply of each
  std::array<bool, most_encoders> disturbed{};
};
/// Asks every address for ID 5, never for ID 8: eight of these in a row are "dynamic addressing". An answer that is
/// damaged every time tells of two encoders with one address, or of a bad line. Error: timeout when nobody answers.
author::Procedure scan(Dialog& dialog, Nodes& found);

}  // namespace absenc::esl
