// SPDX-License-Identifier: Apache-2.0
// Who answers on a line that nobody knows anything about: asks in every protocol that fits, by reads that change
// nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "absenc/client/identify/candidate.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/port/link.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

struct LineSearch {
  std::string place;                    // "/dev/ttyUSB0", "tcp:HOST:PORT", "spi:/dev/spidev0.0"
  std::vector<std::string> settings{};  // of the port: "latency=5"
  Time limit{};                         // of the whole search
  std::function<void(const std::string&)> progress{};
  OpenLink open = open_link;
  std::function<Time()> now = os::now;  // the clock of the ports
  std::function<bool()> over{};         // true: it ends with os::Ended. Empty: never
};

struct LineFindings {
  std::vector<Candidate> candidates{};
  std::size_t requests = 0;        // sent
  std::size_t heard = 0;           // bytes that came, echo taken off
  std::size_t unsolicited = 0;     // of them, before anything was sent
  std::size_t searches = 0;        // for what explains what came: protocols, settings, encoders
  bool only_echo = false;          // all that ever came back was what was sent
  std::set<std::string> lines{};   // that were tried
  std::vector<std::string> notes;  // what could not be tried, and why
  bool out_of_time = false;
  bool interrupted = false;
};

/// A port with its settings: "/dev/ttyUSB0?latency=50". Throws UsageError for what says a protocol.
[[nodiscard]] LineSearch parse_search(std::string_view text);

/// Throws os::Failure when the place cannot be opened at all, UsageError.
[[nodiscard]] LineFindings search_line(const LineSearch& search);

}  // namespace absenc::client
