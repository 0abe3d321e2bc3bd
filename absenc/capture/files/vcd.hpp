// SPDX-License-Identifier: Apache-2.0
// Reader for value change dumps (IEEE 1364, clause 18), as simulators and sigrok write them.
#pragma once

#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns true if a file that begins with `head` is meant for `read_vcd`: its first word opens a section of the
/// header.
[[nodiscard]] bool is_vcd(std::string_view head);

/// Reads a value change dump. Throws OpenError if the header is invalid.
///
/// - Each bit of a net or register is a channel; those of a vector are NAME[INDEX], from its right to its left. A name
///   that occurs in several scopes has the names of its scopes before it, with points. Two names for one identifier are
///   two channels. Variables of other types (real, integer, event, string ...) are left out, with a note.
/// - Ticks are the file's times in units of $timescale. Values at the first time that has values are the initial
///   levels; without an initial level a channel begins low.
/// - x and z (and u, w, - of VHDL) leave the level unchanged, with a note; h and l are 1 and 0.
/// - A time that is invalid or runs backwards, an undeclared identifier, an invalid value change and a section without
///   an end are damages: the changes before them are valid.
[[nodiscard]] std::unique_ptr<Reader> read_vcd(std::unique_ptr<Source> source, std::string_view name);

}  // namespace absenc::capture
