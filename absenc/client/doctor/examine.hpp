// SPDX-License-Identifier: Apache-2.0
// An examination whose surroundings are given: a test has its own. And what it found, for programs.
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
  bool on_the_clock = false;  // the port keeps real time: how late this computer wakes a thread is measured meanwhile
};

/// As the one of client/doctor.hpp.
[[nodiscard]] Examination examine(const EncoderAddress& address, const DoctorChoices& choices,
                                  const Surroundings& surroundings = {.on_the_clock = true});

/// {"ok","findings":[{"id","severity","evidence","cause","action"}],"readings","good","complete","seconds",
/// "failures_below","verdict"}; where they are known, "readings_per_second", "echo", "latency_ms",
/// "quickest_reply_ms","slowest_reply_ms".
[[nodiscard]] Json to_json(const Examination& examination);

}  // namespace absenc::client
