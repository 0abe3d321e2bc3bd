// SPDX-License-Identifier: Apache-2.0
// Value change dumps (IEEE 1364, clause 18), as simulators and sigrok write them.
#pragma once

#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// True when a file that begins so is meant for `read_vcd`: its first word is one that opens a section of the header.
[[nodiscard]] bool is_vcd(std::string_view head);

/// - Each bit of a net or register is a channel; those of a vector are NAME[INDEX], from its right to its left. A name
///   that stands in several scopes is qualified by them, with points. Two names for one identifier are two channels.
///   Variables of other types (real, integer, event, string ...) are left out, with a note.
/// - Ticks are the file's times in units of $timescale. Values at its first time are the levels to begin with; without
///   such a value a channel begins low.
/// - x and z (and u, w, - of VHDL) keep the level before, with a note; h and l are 1 and 0.
/// - Time that runs backwards, an identifier nobody declared and what is no value change are damages: what precedes
///   counts. Throws OpenError when the header makes no sense.
[[nodiscard]] std::unique_ptr<Reader> read_vcd(std::unique_ptr<Source> source, std::string_view name);

}  // namespace absenc::capture
