// SPDX-License-Identifier: Apache-2.0
// Host side of ESL: what takes more than one exchange. A single position is author::ReadPosition<Protocol>. README.md
// describes the procedures.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/sentence.hpp"

namespace absenc::esl {

/// Dialog of procedures.
using Dialog = author::DialogOf<Protocol>;

/// What a procedure found.
struct Found : Shown {
  Reading reading{};                     ///< The position.
  ByteBuffer<last_address + 1> bytes{};  ///< of `data`
  Sentence words{};                      ///< of the error
};

/// ID 8, preceded by an ID 5, so that eight of these in a row are not eight IDs 8 in a row. Error: unexpected_reply (it
/// says another encoder than the options).
author::Procedure read_encoder_id(Dialog& dialog, Found& found);

/// What a safety reading found: each emit is one.
struct FoundSafe : Found {
  static constexpr bool streams = true;  ///< The command streams.
};
/// Safe positions without end: IDs 1 and 2 until the monitor trusts the line, two exchanges when all is well, then one
/// exchange each, so that the sequence counter is compared from reading to reading. Errors: those of the check that
/// failed.
author::Procedure read_safely(Dialog& dialog, FoundSafe& found);

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

/// Which of the two is behind led_or_lissajous_error: page 8 address 1A, after which the page before is selected again;
/// where others share the line, SF (Table 5). Error: unsupported (other alarms raise the same bits of SF).
author::Procedure read_error_info(Dialog& dialog, Found& found);

// ---- Several encoders on one line

inline constexpr unsigned most_encoders = 8;  ///< 3 address bits

/// Addresses at which encoders answered.
struct Nodes {
  std::array<std::optional<Reply>, most_encoders> answers{};  ///< the last good reply of each
  std::array<bool, most_encoders> disturbed{};                ///< Whether replies of an address were disturbed.
  std::array<Check, most_encoders> troubles{};                ///< of an answer that came whole and is not good
};
/// Asks every address for ID 5, never for ID 8: eight of these in a row are "dynamic addressing". An answer that is
/// damaged every time tells of two encoders with one address, or of a bad line. One that comes whole is that of one
/// encoder, also where it refuses or is not as drawn. Error: timeout when nobody answers.
author::Procedure scan(Dialog& dialog, Nodes& found);

}  // namespace absenc::esl
