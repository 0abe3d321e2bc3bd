// SPDX-License-Identifier: Apache-2.0
// Runs a virtual encoder on an existing port: a serial port with a cable to another computer, a USB gadget, or a CAN
// interface.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/client/port/address.hpp"
#include "absenc/core/time.hpp"
#include "absenc/link/step.hpp"

namespace absenc::tool {

using namespace client;

/// Parses the name of a port, "/dev/ttyUSB1", with settings of the port behind `?` as in an address. Throws UsageError.
[[nodiscard]] EncoderAddress parse_served_port(const Unit& unit, std::string_view text);

/// Prints that the encoder is ready, and runs it on a serial port until a signal or the time `end`. If the port is
/// lost, it waits for the port; the encoder then continues unchanged. A transfer due within `send_slack` is sent at
/// once. Throws os::Failure if the port cannot be opened at the start, or does not support a rate that the encoder
/// sets.
void serve_port(Machine<std::uint8_t>& device, const EncoderAddress& uri, Time end);
/// Runs a virtual encoder like `serve_port`, but on a CAN interface such as "vcan0", and without the send slack.
void serve_interface(Machine<CanFrame>& device, const std::string& interface, const LineSettings& line, Time end);

}  // namespace absenc::tool
