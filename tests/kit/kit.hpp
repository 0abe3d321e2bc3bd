// SPDX-License-Identifier: Apache-2.0
// Checks that apply to every protocol unit. They use only the unit's descriptor, so a unit's author writes no code for
// them.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"
#include "tests/kit/findings.hpp"

namespace absenc::kit {

/// Checks that each vector decodes to what it states, and that a good reply is refused after damage, such as a flipped
/// bit that a check covers.
[[nodiscard]] Findings check_decoding(const Unit& unit);

/// Checks the bit positions that the unit states for the fields of good replies: the bits at these positions must give
/// the field's value. Uses the vectors, the vectors with flipped bits that are still valid, and, except on CAN and
/// clocked links, replies of the virtual encoder.
[[nodiscard]] Findings check_places(const Unit& unit);

/// Feeds the replies of vectors, whole and damaged, to the commands that send their requests, and checks what the
/// commands report. Leaves out scans, the commands that change the encoder, and on CAN all commands but those that read
/// the position. It is a finding too if no command reads the position of any vector.
[[nodiscard]] Findings check_hosts(const Unit& unit);

/// Checks that every command that sends a request, a scan too, ends with `timeout` if no encoder answers; one of
/// Verb::run may succeed. Does not apply where the host clocks the line, because it then reads some level at all times.
[[nodiscard]] Findings check_silence(const Unit& unit);

/// Encodes every command with random arguments and decodes the request. Checks that arguments outside their ranges, and
/// too many or too few arguments, are refused.
[[nodiscard]] Findings check_requests(const Unit& unit, std::uint64_t seed);

/// Checks that each command fits into `host_storage`, and writes nothing behind the storage that it gets. A device must
/// need exactly `device_storage`.
[[nodiscard]] Findings check_storage(const Unit& unit);

/// Checks what the unit declares about memory, registers, settings and roles, and that each alarm has a meaning and
/// advice.
[[nodiscard]] Findings check_declarations(const Unit& unit);

/// Runs every command that sets a setting, the zero or the turns, or clears alarms, and checks its effect in the
/// virtual encoder as far as commands can read it.
[[nodiscard]] Findings check_settings(const Unit& unit);

/// Reads, and writes if the unit can, the first and last address of each memory area. Checks that a write to a
/// read-only area is refused, and that registers can be read as declared.
[[nodiscard]] Findings check_memory(const Unit& unit);

/// Checks that a host can observe each condition of the virtual encoder: in some configuration, its least or its
/// greatest value must make a command report something else than its normal value does.
[[nodiscard]] Findings check_conditions(const Unit& unit);

/// Runs every command that changes nothing, except scans, with each alarm raised and not raised in the virtual encoder.
/// A reading, live or decoded from the captured reply, must report the alarm correctly or not at all, and must not call
/// a position valid that the reading of Verb::read calls invalid.
[[nodiscard]] Findings check_states(const Unit& unit);

/// Checks that the zero command is refused with a reason, and leaves the encoder unchanged, while an alarm or a
/// condition makes the position invalid.
[[nodiscard]] Findings check_zero(const Unit& unit);

/// Checks the advice for alarms and errors. A command in backquotes, as "`absenc run ... reset`", must exist in this
/// unit. Following the advice for an alarm must end the alarm, give an explanation, or report more than the reading.
[[nodiscard]] Findings check_advice(const Unit& unit);

/// Runs each command that changes nothing, in each configuration, on an undamaged line. Positions must equal that of
/// the shaft. With the options of a model `read` must succeed, commands such as `info` must succeed or be refused, and
/// the host must break no rule.
[[nodiscard]] Findings check_commands(const Unit& unit);

/// Settings of `check_exchanges`, which runs hosts against virtual encoders in virtual time over a line with faults.
/// Hosts may report no more wrong results than the checks of the damaged replies let pass.
struct ExchangeTest {
  std::uint64_t count = 100'000;
  std::uint64_t seed = 0;
  bool requests_too = false;  // true: requests are damaged too; false: only replies
};
[[nodiscard]] Findings check_exchanges(const Unit& unit, const ExchangeTest& test);

}  // namespace absenc::kit
