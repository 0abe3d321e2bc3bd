// SPDX-License-Identifier: Apache-2.0
// Checks that apply to every protocol unit and need only its descriptor.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"
#include "tests/kit/findings.hpp"

namespace absenc::kit {

/// Checks that the unit decodes the replies of its test vectors, and refuses damaged ones.
[[nodiscard]] Findings check_decoding(const Unit& unit);

/// Checks the bit positions that the unit states for its fields: the bits there must have the field's value.
[[nodiscard]] Findings check_places(const Unit& unit);

/// Runs commands that send the request of a test vector, and supplies the reply of the vector, whole and damaged.
[[nodiscard]] Findings check_hosts(const Unit& unit);

/// Checks that each command ends, and with which error, if no encoder answers.
[[nodiscard]] Findings check_silence(const Unit& unit);

/// Checks requests with random arguments, and the refusal of wrong arguments.
[[nodiscard]] Findings check_requests(const Unit& unit, std::uint64_t seed);

/// Checks that commands fit `host_storage`, and that a device needs exactly `device_storage`.
[[nodiscard]] Findings check_storage(const Unit& unit);

/// Checks what the unit declares about memory, registers, settings, roles and alarms.
[[nodiscard]] Findings check_declarations(const Unit& unit);

/// Checks the effect of commands that change a setting, the zero, turns or alarms.
[[nodiscard]] Findings check_settings(const Unit& unit);

/// Checks registers, and the first and last address of each memory area.
[[nodiscard]] Findings check_memory(const Unit& unit);

/// Checks that each condition of the virtual encoder can change the report of some command.
[[nodiscard]] Findings check_conditions(const Unit& unit);

/// Checks that readings, live and captured, report each alarm correctly or not at all.
[[nodiscard]] Findings check_states(const Unit& unit);

/// Checks that the zero command is refused while the position is invalid.
[[nodiscard]] Findings check_zero(const Unit& unit);

/// Checks the wording and the effect of the advice for alarms and errors.
[[nodiscard]] Findings check_advice(const Unit& unit);

/// Runs, on a line without faults, each command that does not change the encoder, and checks the reported fields.
[[nodiscard]] Findings check_commands(const Unit& unit);

/// Runs commands as services beside the cyclic position requests of a drive, and checks the results of both.
[[nodiscard]] Findings check_cycles(const Unit& unit);

/// Runs cycles while the shaft accelerates and replies are damaged or late, and compares each position with the shaft.
[[nodiscard]] Findings check_turning(const Unit& unit);

/// Settings of `check_exchanges`, which runs hosts against virtual encoders on a faulty line.
struct ExchangeTest {
  std::uint64_t count = 100'000;
  std::uint64_t seed = 0;
  bool requests_too = false;  // true: requests are damaged too; false: only replies
};
[[nodiscard]] Findings check_exchanges(const Unit& unit, const ExchangeTest& test);

}  // namespace absenc::kit
