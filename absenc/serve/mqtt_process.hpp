// SPDX-License-Identifier: Apache-2.0
// The process that talks to the broker for `absenc serve`. It is this program, started again with an internal verb.
//
// libmosquitto 2.0.11 ends its process at some packets, by assertions in its parser of properties. The separate process
// reads no encoder, and the readings and events that it got are in the spool, so its end costs only the connection. The
// process is started from /proc/self/exe, not from a second program file: so it is always the same version, in a build
// tree, installed, from the Debian package, and while the package is being upgraded.
#pragma once

#include <string_view>

namespace absenc::serve {

/// The internal verb of `absenc` that starts the MQTT client process.
inline constexpr std::string_view mqtt_process_verb = "serve-mqtt-client";

/// Runs the MQTT client process until the parent ends or sends Wire::leave, the connection is lost, or its settings
/// cannot be used. Returns the exit status for `main`.
[[nodiscard]] int run_mqtt_process();

}  // namespace absenc::serve
