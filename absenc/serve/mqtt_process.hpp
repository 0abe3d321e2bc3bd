// SPDX-License-Identifier: Apache-2.0
// The process that talks to the broker for `absenc serve`: this program, started again with an internal word.
//
// A separate process is needed because libmosquitto 2.0.11 aborts at some packets, by assertions in its parser of
// properties. The process runs the same program file, because a second file could have another version while the
// package is being upgraded.
#pragma once

#include <string_view>

namespace absenc::serve {

/// The word behind the verb `serve` that makes the program the MQTT client process.
inline constexpr std::string_view mqtt_process_word = "serve-mqtt-client";

/// Runs the MQTT client process. Returns the exit status for `main`.
[[nodiscard]] int run_mqtt_process();

}  // namespace absenc::serve
