// SPDX-License-Identifier: Apache-2.0
// Runs a virtual encoder on an existing port.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/client/port/address.hpp"
#include "absenc/core/time.hpp"
#include "absenc/link/step.hpp"

namespace absenc::tool {

using namespace client;

/// Parses the name of a port, with settings behind `?` as in an address. Throws UsageError.
[[nodiscard]] EncoderAddress parse_served_port(const Unit& unit, std::string_view text);

/// Runs a virtual encoder on a serial port until a signal arrives or the time `end` is reached; waits until a lost port
/// is back. Throws os::Failure.
void serve_port(Machine<std::uint8_t>& device, const EncoderAddress& uri, Time end);
/// Runs a virtual encoder like `serve_port`, but on a CAN interface such as "vcan0".
void serve_interface(Machine<CanFrame>& device, const std::string& interface, const LineSettings& line, Time end);

}  // namespace absenc::tool
