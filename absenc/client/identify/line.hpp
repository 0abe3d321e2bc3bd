// SPDX-License-Identifier: Apache-2.0
// Finds the encoders on an unknown line: sends read requests, which change nothing, of every protocol that fits.
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
  std::vector<std::string> settings{};  // settings of the port, such as "latency=5"
  Time limit{};                         // time limit of the whole search
  std::function<void(const std::string&)> progress{};
  OpenLink open = open_link;
  std::function<Time()> now = os::now;  // the clock of the port
  std::function<bool()> over{};         // the search ends with os::Ended when it returns true; empty: never
};

struct LineFindings {
  std::vector<Candidate> candidates{};
  std::size_t requests = 0;     // number of requests sent
  std::size_t heard = 0;        // number of bytes received, without echo
  std::size_t unsolicited = 0;  // number of them received before the first request
  std::size_t searches =
      0;                   // number of combinations of protocol, settings and encoder that were tried as an explanation
  bool only_echo = false;  // only the adapter's echo was received
  std::set<std::string> lines{};   // the kinds of lines that were tried
  std::vector<std::string> notes;  // protocols that could not be tried, and why
  bool out_of_time = false;
  bool interrupted = false;
};

/// Parses a port with its settings: "/dev/ttyUSB0?latency=50". Throws UsageError, also if it names a protocol.
[[nodiscard]] LineSearch parse_search(std::string_view text);

/// Runs the search. Throws os::Failure if the port cannot be opened, UsageError.
[[nodiscard]] LineFindings search_line(const LineSearch& search);

}  // namespace absenc::client
