// SPDX-License-Identifier: Apache-2.0
// Commands of EnDat that need several requests; README.md describes them.
#pragma once

#include "absenc/protocol/endat/fields.hpp"

namespace absenc::endat {

/// The conversation through which procedures send requests.
using Dialog = author::DialogOf<Protocol>;

/// Greatest number of words that one command reads.
inline constexpr std::size_t most_words = 128;

/// Result of a procedure: the values of its fields, a reading, and words of the memory.
struct ProcedureResult : Values {
  Reading reading{};                 ///< Position with its alarms; empty if the procedure read none.
  ByteBuffer<2 * most_words> words;  ///< Storage of the words that the fields with bytes show.
};

/// Reads the position of an encoder whose resolution is asked first. Errors: unsupported, cross_check_failed, or that
/// of an exchange.
author::Procedure read_position(Dialog& dialog, ProcedureResult& found);
/// Reads the position, the error messages and the warnings.
author::Procedure read_status(Dialog& dialog, ProcedureResult& found);
/// Clears error messages and warnings, and verifies it. Errors: cross_check_failed if any remains.
author::Procedure clear_alarms(Dialog& dialog, ProcedureResult& found);
/// Reads the parameters that describe the encoder.
author::Procedure read_info(Dialog& dialog, ProcedureResult& found);

/// Reads words of the memory. Arguments: MRS code of the area, address of the first word, number of words.
author::Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);
/// Writes a word if it differs, and verifies it. Arguments: MRS code of the area, address, value.
author::Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Makes the present position the zero by the datum shift, verifies it, and selects the additional information of the
/// format again. Errors: unsupported, invalid_argument, not_still, cross_check_failed, or that of an exchange.
author::Procedure set_zero(Dialog& dialog, ProcedureResult& found);
/// Resets the encoder, waits until it has started, reads the position, and selects the additional information of the
/// format again.
author::Procedure reset(Dialog& dialog, ProcedureResult& found);
/// Resets errors that the encoder can reset within a control cycle (EnDat 2.2), reads the position, and selects the
/// additional information from before again. Error: cross_check_failed if an error remains.
author::Procedure reset_errors(Dialog& dialog, ProcedureResult& found);
/// Reads the recovery time that is selected for EnDat 2.2.
author::Procedure read_recovery(Dialog& dialog, ProcedureResult& found);
/// Selects a recovery time, and verifies it. Argument: 0 long, 1 short.
author::Procedure set_recovery(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Reads additional information with a position. Arguments: the MRS codes of information 1 and of information 2; 0: it
/// stays as it is. The selection from before is restored.
author::Procedure read_infos(Dialog& dialog, ProcedureResult& found, Arguments arguments);
/// Reads the temperature inside the encoder.
author::Procedure read_temperature(Dialog& dialog, ProcedureResult& found);
/// Measures the delay of line and transceivers. Errors: unsupported if the position takes too long to be calculated.
author::Procedure measure_delay(Dialog& dialog, ProcedureResult& found);

}  // namespace absenc::endat
