// SPDX-License-Identifier: Apache-2.0
// The process that speaks to the broker for `absenc serve`: this program, run again with a verb that nobody types.
//
// libmosquitto 2.0.11 ends its process at some packets (assertions in its reader of properties). This process reads no
// encoder and holds no message that is not also in the spool, so its end costs a connection and nothing else.
// It is the program itself and no second file: /proc/self/exe is the same version in a build tree, installed, from the
// Debian package and while that is being replaced by a newer one.
#pragma once

#include <string_view>

namespace absenc::serve {

/// The word that `absenc` is run with.
inline constexpr std::string_view mqtt_process_verb = "serve-mqtt-client";

/// Until the parent ends or wants it to end. Returns the status for `main`.
[[nodiscard]] int run_mqtt_process();

}  // namespace absenc::serve
