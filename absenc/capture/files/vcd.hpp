// SPDX-License-Identifier: Apache-2.0
// Reader for value change dumps (IEEE 1364, clause 18), as simulators and sigrok write them.
#pragma once

#include <memory>
#include <string_view>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns whether the first word of `head` opens a section of a value change dump's header.
[[nodiscard]] bool is_vcd(std::string_view head);

/// Reads a value change dump. Throws OpenError.
///
/// - Each bit of a net or register is a channel; other variables are left out.
/// - Ticks are the file's times in units of $timescale.
/// - Unknown values, like x and z, leave the level unchanged.
[[nodiscard]] std::unique_ptr<Reader> read_vcd(std::unique_ptr<Source> source, std::string_view name);

}  // namespace absenc::capture
