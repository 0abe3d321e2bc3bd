// SPDX-License-Identifier: Apache-2.0
// Host side of ESL: its procedures. The template author::ReadPosition, with the Protocol of reply.hpp, reads a single
// position.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/sentence.hpp"

namespace absenc::esl {

/// The conversation through which ESL procedures send requests.
using Dialog = author::DialogOf<Protocol>;

/// Result of an ESL procedure other than `scan`: the values of its fields, its reading, and the data to which they
/// refer.
struct ProcedureResult : Shown {
  Reading reading{};                     ///< Reading of the last reply; empty in procedures that read no position.
  ByteBuffer<last_address + 1> bytes{};  ///< memory bytes to which the field `data` refers
  Sentence words{};                      ///< text of the error's detail
};

/// Reads the encoder id by an ID 8 after an ID 5, so that eight runs of this procedure do not send eight consecutive
/// IDs 8. Errors: unexpected_reply (another encoder than the options state), or that of an exchange.
author::Procedure read_encoder_id(Dialog& dialog, ProcedureResult& found);

/// Result of `read_safely`: a safe position. Each step `emit` delivers one.
struct SafePositionResult : ProcedureResult {
  static constexpr bool streams = true;  ///< Marks that the procedure delivers results without end.
};
/// Reads safe positions until an error. The first one takes two exchanges, with IDs 1 and 2 (see SafetyMonitor); each
/// further one takes one exchange. Errors: that of the failed check, or of an exchange.
author::Procedure read_safely(Dialog& dialog, SafePositionResult& found);

/// Resets by the data ID B (single-turn zero here), C (alarms) or D (turns): makes sure that the shaft stands still,
/// sends eight requests, and verifies the result. Errors: invalid_argument (the encoder is not ready or, for B, its
/// position is invalid), not_still (the shaft turns), cross_check_failed (position, turns or alarms are not as the
/// reset demands; the detail says which), or that of an exchange.
author::Procedure reset(Dialog& dialog, ProcedureResult& found, DataId id);

// ---- Memory (Tables 9 to 11, Figures 14 and 15); only with one encoder on the line

/// Reads bytes of the memory. Arguments: address, page, count. Errors: invalid_argument (a byte is not in Table 11),
/// busy, or that of an exchange.
author::Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Reads a byte of the memory and, if it differs from `value`, writes it and reads it back. Arguments: address, value,
/// page, force. Errors: invalid_argument (not in Table 11, or protected and without force), busy, cross_check_failed
/// (another value was read back), or that of an exchange.
author::Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Selects a memory page and leaves it selected, for users who send memory requests themselves. Arguments: page.
/// Errors: invalid_argument (not in Table 11), busy, cross_check_failed (another page is selected), or that of an
/// exchange.
author::Procedure select_page(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Finds whether the LED or the Lissajous signals raise led_or_lissajous_error: reads address 0x1A of page 8, then
/// selects the page from before again, if it is known. With several encoders on the line it reads SF instead (Table 5).
/// Errors: unsupported (other alarms raise the same bits of SF), busy, or that of an exchange.
author::Procedure read_error_info(Dialog& dialog, ProcedureResult& found);

// ---- Several encoders on one line

inline constexpr unsigned most_encoders = 8;  ///< most encoders on a line, because an address has 3 bits

/// Result of `scan`: what was received at each address.
struct Nodes {
  std::array<std::optional<Reply>, most_encoders> answers{};  ///< valid reply of each address; nothing: there was none
  std::array<bool, most_encoders> disturbed{};  ///< Whether the last of three replies of an address was damaged.
  /// For each address, the check that a complete but invalid reply failed; `passed`: there was no such reply.
  std::array<Check, most_encoders> troubles{};
};
/// Finds the encoders on the line by an ID 5 to every address. It never sends ID 8, because eight consecutive IDs 8 are
/// "dynamic addressing". Errors: timeout (no address answers), or that of a line that is never silent.
author::Procedure scan(Dialog& dialog, Nodes& found);

}  // namespace absenc::esl
