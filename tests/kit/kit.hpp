// SPDX-License-Identifier: Apache-2.0
// Checks that apply to every protocol unit. They use only the unit's descriptor, so a unit's author writes no code for
// them.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"
#include "tests/kit/findings.hpp"

namespace absenc::kit {

/// Decodes every vector with `decode` and `frame_end`. A good frame must have the fields of the vector; it must be
/// refused if cut after any element, with any checked bit flipped and, except on CAN and clocked links, with a second
/// reply appended.
[[nodiscard]] Findings check_decoding(const Unit& unit);

/// Checks the bit positions that the unit states for the fields of good replies: the bits at these positions must give
/// the field's value. Uses the vectors, the vectors with flipped bits that are still valid, and, except on CAN and
/// clocked links, replies of the virtual encoder.
[[nodiscard]] Findings check_places(const Unit& unit);

/// Feeds every vector's reply to the commands that send its request, as far as the link permits: whole, byte by byte,
/// cut after each byte, with each checked bit flipped, with garbage before and after it, and twice. Leaves out scans,
/// the commands that change the encoder, and on CAN all commands but those that read the position. It is a finding if
/// no command reads the position of any vector, or if `encode` refuses a command in every configuration, other than as
/// unsupported.
[[nodiscard]] Findings check_hosts(const Unit& unit);

/// Checks that every command that sends a request, a scan too, ends with `timeout` if no encoder answers; a command
/// that expects no reply may succeed. Does not apply where the host clocks the line, because such a line is never
/// silent.
[[nodiscard]] Findings check_silence(const Unit& unit);

/// Encodes every command with random arguments and decodes the request: its fields must contain the required arguments
/// that it has a field for. Arguments outside their ranges must be refused.
[[nodiscard]] Findings check_requests(const Unit& unit, std::uint64_t seed);

/// Runs each command in the smallest storage that it accepts. This must be no larger than the declared size, no byte
/// after it may be written, and one byte less must be refused. A device must need exactly its declared size.
[[nodiscard]] Findings check_storage(const Unit& unit);

/// Checks that the commands, arguments, fields and options exist which memory, registers, settings and verbs of the
/// descriptor need, and that each alarm has a meaning and advice.
[[nodiscard]] Findings check_declarations(const Unit& unit);

/// Runs every command that sets a setting, the zero or the turns, or clears alarms, and checks its effect in the
/// virtual encoder by reading back.
[[nodiscard]] Findings check_settings(const Unit& unit);

/// Writes the first and last byte of each memory area and reads them back. Checks that a write to a read-only area is
/// refused.
[[nodiscard]] Findings check_memory(const Unit& unit);

/// Checks that a host can observe each condition of the virtual encoder at one end of its range at least: in some
/// configuration a command must report something else than normally, at once, after a power cycle, with alarms, or
/// after a reset.
[[nodiscard]] Findings check_conditions(const Unit& unit);

/// Runs every command that changes nothing, except scans, with each alarm raised and not raised in the virtual encoder.
/// A reading, live or decoded from the captured reply, must report the alarm correctly or not at all. Raised bits must
/// be reported, and so must flags that the reply carries. A part of a position must not be valid if the whole reading
/// is invalid.
[[nodiscard]] Findings check_states(const Unit& unit);

/// Checks that the zero command is refused with a reason, and leaves the encoder unchanged, while an alarm or a
/// condition makes the position invalid.
[[nodiscard]] Findings check_zero(const Unit& unit);

/// Checks the advice for alarms and errors. Every command that an advice names must stand in backquotes, as "`absenc
/// run ... reset`", and exist in this unit. With the alarm raised, the named commands must end the alarm, state why
/// they cannot, or report more than the reading. No advice may be circular, and no message may repeat a clause.
[[nodiscard]] Findings check_advice(const Unit& unit);

/// Runs each command that changes nothing, in each configuration, on an undamaged line. Positions must equal that of
/// the shaft. With the options of a model `read` must succeed, commands such as `info` must succeed or be refused, and
/// the host must break no rule.
[[nodiscard]] Findings check_commands(const Unit& unit);

/// Settings of `check_exchanges`, which runs hosts against virtual encoders in virtual time over a line with faults.
/// Wrong results of commands whose replies have a check are findings if no byte of the conversation was damaged. With
/// damaged bytes they may be no more frequent than the check allows.
struct ExchangeTest {
  std::uint64_t count = 100'000;
  std::uint64_t seed = 0;
  bool requests_too = false;  // true: requests are damaged too; false: only replies
};
[[nodiscard]] Findings check_exchanges(const Unit& unit, const ExchangeTest& test);

}  // namespace absenc::kit
