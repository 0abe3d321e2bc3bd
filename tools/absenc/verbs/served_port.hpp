// SPDX-License-Identifier: Apache-2.0
// A virtual encoder on a port that is there already: a serial one of a cable to another computer or of a USB gadget, or
// a CAN interface.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/client/port/address.hpp"
#include "absenc/core/time.hpp"
#include "absenc/link/step.hpp"

namespace absenc::tool {

using namespace client;

/// "/dev/ttyUSB1", with settings of the port behind it as behind an encoder. Throws UsageError.
[[nodiscard]] EncoderAddress parse_served_port(const Unit& unit, std::string_view text);

/// Says that it is ready, and serves until a signal or `end`. A port that goes away is waited for: whoever plugs it in
/// again finds the encoder as it was. A transfer due within `send_slack` is sent at once.
/// Throws os::Failure when it cannot be opened at first.
void serve_port(Machine<std::uint8_t>& device, const EncoderAddress& uri, Time end);
/// The same on a CAN interface, as "vcan0".
void serve_interface(Machine<CanFrame>& device, const std::string& interface, const LineSettings& line, Time end);

}  // namespace absenc::tool
