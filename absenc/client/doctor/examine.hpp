// SPDX-License-Identifier: Apache-2.0
// Runs an examination with a replaceable port and clock, and converts its result to JSON.
#pragma once

#include <functional>
#include <string>

#include "absenc/client/doctor/observations.hpp"
#include "absenc/client/port/link.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::client {

struct Surroundings {
  OpenLink open = open_link;
  std::function<os::PortFacts(const std::string& path)> facts = [](const std::string& path) {
    return os::port_facts(path);
  };
  // whether the port runs in real time, so that the delay of this computer must be measured
  bool on_the_clock = false;
};

/// Examines an encoder like client::examine of client/doctor.hpp, but opens ports and reads their properties with the
/// functions of `surroundings`.
[[nodiscard]] Examination examine(const EncoderAddress& address, const DoctorChoices& choices,
                                  const Surroundings& surroundings = {.on_the_clock = true});

/// Converts the result to {"ok","findings":[{"id","severity","evidence","cause","action"}],"readings","good",
/// "complete","seconds","failures_below","not_looked_at":[],"verdict"}; if known, also "readings_per_second", "echo",
/// "computer_late_ms", "latency_ms", "quickest_reply_ms", "slowest_reply_ms".
[[nodiscard]] Json to_json(const Examination& examination);

}  // namespace absenc::client
