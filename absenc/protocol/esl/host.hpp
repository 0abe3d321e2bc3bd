// SPDX-License-Identifier: Apache-2.0
// Procedures of the host side of ESL.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/sentence.hpp"

namespace absenc::esl {

/// The conversation through which ESL procedures send requests.
using Dialog = author::DialogOf<Protocol>;

/// Result of an ESL procedure other than `scan`.
struct ProcedureResult : Shown {
  Reading reading{};                     ///< Reading of the last reply; empty if the procedure reads no position.
  ByteBuffer<last_address + 1> bytes{};  ///< storage of the memory bytes that are reported in the field `data`
  Sentence words{};                      ///< storage of the text that explains an error
};

/// Reads the encoder id with data ID 8. Sends a request with data ID 5 before it, so that an encoder never receives
/// eight consecutive requests with data ID 8. Error besides those of the exchanges: unexpected_reply.
author::Procedure read_encoder_id(Dialog& dialog, ProcedureResult& found);

/// Result of `read_safely`: a safe position. The procedure emits one result after the other.
struct SafePositionResult : ProcedureResult {
  static constexpr bool streams = true;  ///< Marks that the procedure emits results until it is stopped or fails.
};
/// Reads safe positions until an error: that of a failed check, or of an exchange.
author::Procedure read_safely(Dialog& dialog, SafePositionResult& found);

/// Sends the eight requests of a reset with data ID B (zero), C (alarms) or D (turns), and verifies the result. Errors
/// besides those of the exchanges: invalid_argument, not_still, cross_check_failed.
author::Procedure reset(Dialog& dialog, ProcedureResult& found, DataId id);

// ---- Memory (Tables 9 to 11, Figures 14 and 15); only with one encoder on the line

/// Reads bytes of the memory. Arguments: address, page, number of bytes. Errors: invalid_argument, busy, or that of an
/// exchange.
author::Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Writes a byte of the memory if it differs, and reads it back. Arguments: address, value, page, force. Errors:
/// invalid_argument, busy, cross_check_failed, or that of an exchange.
author::Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Selects a memory page and leaves it selected. Argument: page. Errors: invalid_argument, busy, cross_check_failed, or
/// that of an exchange.
author::Procedure select_page(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Finds whether the LED or the Lissajous signals raise led_or_lissajous_error. Errors: unsupported, busy, or that of
/// an exchange.
author::Procedure read_error_info(Dialog& dialog, ProcedureResult& found);

// ---- Several encoders on one line

inline constexpr unsigned most_encoders = 8;  ///< greatest number of encoders on a line; an address has 3 bits

/// Result of `scan`: the reply or the error of each address.
struct Nodes {
  /// valid reply of each address; no value if none was received
  std::array<std::optional<Reply>, most_encoders> answers{};
  std::array<bool, most_encoders> disturbed{};  ///< For each address, whether the last of three replies was damaged.
  /// For each address, the check that a complete reply failed; `passed` if it failed none.
  std::array<Check, most_encoders> troubles{};
};
/// Finds the encoders on the line by a request with data ID 5 to every address. Errors: timeout, or that of a line that
/// is never silent.
author::Procedure scan(Dialog& dialog, Nodes& found);

}  // namespace absenc::esl
