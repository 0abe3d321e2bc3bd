// SPDX-License-Identifier: Apache-2.0
// Commands of the A-format that need several requests; README.md describes them.
#pragma once

#include "absenc/protocol/nikon/fields.hpp"

namespace absenc::nikon {

/// The conversation through which procedures send requests.
using Dialog = author::DialogOf<Protocol>;

/// Result of a procedure: the values of its fields, a reading, and storage of EEPROM words.
struct ProcedureResult : Values {
  Reading reading{};  ///< Position and turns with their alarms; empty if the procedure read none.
  /// storage of the EEPROM words that the field `data` reports, the low byte of each first
  ByteBuffer<2 * word_count> words{};
};

/// Sends the eight requests of a reset (command code 8, 9, 10 or 12), and verifies the result. Errors:
/// invalid_argument, not_still, cross_check_failed, or that of an exchange.
author::Procedure reset(Dialog& dialog, ProcedureResult& found, Code code);

/// Reads words of the EEPROM. Arguments: address of the first word, number of words. Errors: invalid_argument,
/// unexpected_reply, or that of an exchange.
author::Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Writes a word of the user's EEPROM if it differs, and verifies it. Arguments: address, value. Errors:
/// invalid_argument, cross_check_failed, unexpected_reply, or that of an exchange.
author::Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Writes the identification if it differs, and verifies it. Arguments: identification. Errors: cross_check_failed, or
/// that of an exchange.
author::Procedure write_identity(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Gives a new address to the only encoder of the line. Argument: address. Errors: invalid_argument,
/// cross_check_failed, or that of an exchange.
author::Procedure set_address(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Gives a new address to the encoder that has an identification. Arguments: address, identification. Errors:
/// invalid_argument, cross_check_failed, or that of an exchange.
author::Procedure assign_address(Dialog& dialog, ProcedureResult& found, Arguments arguments);

}  // namespace absenc::nikon
