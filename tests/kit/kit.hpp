// SPDX-License-Identifier: Apache-2.0
// What every unit is tested with, from its descriptor alone: no line of it is written by the unit's author.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"
#include "tests/kit/findings.hpp"

namespace absenc::kit {

/// Every vector through `decode` and `frame_end`: whole, cut at each element, with each bit flipped that is checked,
/// one reply too many.
[[nodiscard]] Findings check_decoding(const Unit& unit);

/// Where the unit says that the fields of good replies stand: vectors, those that a flip makes of them, and what the
/// virtual encoder answers. The bits, cut out and put together, are the field's number.
[[nodiscard]] Findings check_places(const Unit& unit);

/// Every vector's reply fed to the conversations of the commands whose request it has: whole, byte by byte, cut at each
/// byte, with each bit flipped, garbage before and behind, one frame too many. A vector's reading that no command
/// reads, and a command without a request, are findings.
[[nodiscard]] Findings check_hosts(const Unit& unit);

/// Silence is no reply: a command whose requests nobody answers ends with `timeout`, a scan too. Links whose host
/// clocks the line have no silence.
[[nodiscard]] Findings check_silence(const Unit& unit);

/// Requests of every command with random arguments: what `encode` makes is a good request with these arguments in its
/// fields. Arguments outside their ranges are refused.
[[nodiscard]] Findings check_requests(const Unit& unit, std::uint64_t seed);

/// Each command in exactly the storage that it needs, which is at most what is declared, and no byte behind it is
/// touched; with one byte less there is no conversation. The same of devices.
[[nodiscard]] Findings check_storage(const Unit& unit);

/// What the descriptor says of memory, registers and settings names commands and arguments that are there.
[[nodiscard]] Findings check_declarations(const Unit& unit);

/// Every setting is written and read back over the virtual encoder.
[[nodiscard]] Findings check_settings(const Unit& unit);

/// The first and the last byte of each memory area are written and read back; what cannot be written is refused.
[[nodiscard]] Findings check_memory(const Unit& unit);

/// Each condition of the virtual encoder, at the ends of its range, is seen by a host: in some configuration a command
/// tells something else than normally, at once, after the power was away, or of alarms and resets.
[[nodiscard]] Findings check_conditions(const Unit& unit);

/// Every alarm raised in the virtual encoder, and every command: what a reading says of the alarm, live and of the
/// captured reply, is that it is raised, or nothing; without it, that it is clear, or nothing. Bits that are raised are
/// reported, and so are flags that a reply carries. A part of a position is valid only where the whole reading says so
/// too.
[[nodiscard]] Findings check_states(const Unit& unit);

/// Whatever makes the position invalid, each alarm and each condition at the ends of its range, the zero is refused
/// with a reason, and nothing of the encoder has changed.
[[nodiscard]] Findings check_zero(const Unit& unit);

/// What people are told to do, of alarms and of errors. A command that an advice names stands in backquotes, as
/// "`absenc run ... reset`", and this unit has it. Carried out with the alarm raised, what an alarm's advice names ends
/// the alarm, says why it does not, or tells what the reading does not. No advice is to look again at what it is about,
/// and no message says a thing twice.
[[nodiscard]] Findings check_advice(const Unit& unit);

/// On an undamaged line each command ends well, in each configuration of the unit, and positions are where the shaft
/// stands.
[[nodiscard]] Findings check_commands(const Unit& unit);

/// Host against virtual encoder in virtual time, over a line with every kind of fault. The shaft's place is known, and
/// so is what each command says of it on an undamaged line: anything else is an error where no byte of the conversation
/// was damaged, and elsewhere so rare as the check of the frames allows.
struct ExchangeTest {
  std::uint64_t count = 100'000;
  std::uint64_t seed = 0;
  bool requests_too = false;  // also what the encoder hears is damaged
};
[[nodiscard]] Findings check_exchanges(const Unit& unit, const ExchangeTest& test);

}  // namespace absenc::kit
