// SPDX-License-Identifier: Apache-2.0
// Host side of ESL: procedures with several exchanges. author::ReadPosition<Protocol> reads a single position.
// README.md describes the procedures.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/sentence.hpp"

namespace absenc::esl {

/// Dialog of procedures.
using Dialog = author::DialogOf<Protocol>;

/// Result of a procedure.
struct ProcedureResult : Shown {
  Reading reading{};                     ///< The position.
  ByteBuffer<last_address + 1> bytes{};  ///< bytes of `data`
  Sentence words{};                      ///< detail of the error
};

/// Reads ID 8 after an ID 5, so that eight of these procedures in a row do not send eight IDs 8 in a row. Error:
/// unexpected_reply (another encoder than the options state).
author::Procedure read_encoder_id(Dialog& dialog, ProcedureResult& found);

/// Result of a safety reading: each emit is one.
struct SafePositionResult : ProcedureResult {
  static constexpr bool streams = true;  ///< The command streams.
};
/// Reads safe positions without end: IDs 1 and 2 until the monitor trusts the line, which takes two exchanges without
/// errors, then one exchange each, so that the sequence counter is compared from reading to reading. Errors: those of
/// the check that failed.
author::Procedure read_safely(Dialog& dialog, SafePositionResult& found);

/// Sends IDs B (single-turn zero here), C (clear alarms) and D (turns): makes sure that the shaft stands still, sends
/// eight requests, and verifies the result. Errors: invalid_argument (the shaft turns, the encoder is not ready),
/// cross_check_failed (the encoder did not execute it; the detail names what remains), or that of an exchange.
author::Procedure reset(Dialog& dialog, ProcedureResult& found, DataId id);

// ---- Memory (Tables 9 to 11, Figures 14 and 15); only with one encoder on the line

/// Reads bytes. Arguments: address, page, count. Errors: invalid_argument (not in Table 11), busy.
author::Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Reads a byte, writes it if it differs, waits, and reads it back. Arguments: address, value, page, force. Errors:
/// invalid_argument (not in Table 11, or protected and without force), busy, cross_check_failed (another value was read
/// back).
author::Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Selects a page, for users who send memory requests themselves. Arguments: page.
author::Procedure select_page(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Finds whether the LED or the Lissajous signals raise led_or_lissajous_error: reads page 8 address 1A, then selects
/// the page before again; with several encoders on the line, reads SF (Table 5). Error: unsupported (other alarms raise
/// the same bits of SF).
author::Procedure read_error_info(Dialog& dialog, ProcedureResult& found);

// ---- Several encoders on one line

inline constexpr unsigned most_encoders = 8;  ///< an address has 3 bits

/// Addresses at which encoders answered.
struct Nodes {
  std::array<std::optional<Reply>, most_encoders> answers{};  ///< last valid reply of each address
  std::array<bool, most_encoders> disturbed{};                ///< Whether replies of an address were disturbed.
  std::array<Check, most_encoders> troubles{};                ///< error of a complete but invalid answer
};
/// Requests ID 5 at every address, never ID 8: eight of these in a row are "dynamic addressing". An answer that is
/// damaged every time comes from two encoders with one address, or from a bad line. A complete answer comes from one
/// encoder, even if it refuses or differs from the drawing. Error: timeout if no address answers.
author::Procedure scan(Dialog& dialog, Nodes& found);

}  // namespace absenc::esl
