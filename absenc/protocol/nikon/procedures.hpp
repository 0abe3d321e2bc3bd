// SPDX-License-Identifier: Apache-2.0
// Host side of the A-format: commands of several requests, which README.md describes. ReadPosition (host.hpp) reads a
// single position.
#pragma once

#include "absenc/protocol/nikon/fields.hpp"

namespace absenc::nikon {

/// The conversation through which procedures send requests.
using Dialog = author::DialogOf<Protocol>;

/// Result of a procedure: the values of its fields, the reading of the position, and words of the EEPROM.
struct ProcedureResult : Values {
  Reading reading{};                   ///< Position and turns with their alarms; empty if none were read.
  ByteBuffer<2 * word_count> words{};  ///< words to which the field `data` refers, the low byte of each first
};

/// Sends the eight requests of a reset with the code CC 8, 9, 10 or 12, and verifies the result. Errors:
/// invalid_argument (CC 12: the position is invalid), not_still (the shaft turns; not CC 8), cross_check_failed (the
/// encoder did not execute it, which the detail describes), or that of an exchange.
author::Procedure reset(Dialog& dialog, ProcedureResult& found, Code code);

/// Reads words of the EEPROM. Arguments: address, count. Errors: invalid_argument (beyond the last address),
/// unexpected_reply (another word than the requested one), or that of an exchange.
author::Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Reads a word of the user's EEPROM, writes it if it differs, and reads it back. Arguments: address, value. Errors:
/// invalid_argument (no word of the user), cross_check_failed (another value was read back), those of `read_memory`, or
/// that of an exchange.
author::Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Reads the identification, writes it if it differs, and reads it back. Arguments: identification. Errors:
/// cross_check_failed (another value was read back), or that of an exchange.
author::Procedure write_identity(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Gives another address to the only encoder of the line, and finds it there. Arguments: address. Errors:
/// invalid_argument (another encoder answers), cross_check_failed (another encoder is at the new address), or that of
/// an exchange.
author::Procedure set_address(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Gives an address to the encoder with an identification, and finds it there. Arguments: address, identification.
/// Errors: invalid_argument (another encoder has the address), cross_check_failed (another encoder is at the new
/// address), or that of an exchange.
author::Procedure assign_address(Dialog& dialog, ProcedureResult& found, Arguments arguments);

}  // namespace absenc::nikon
