// SPDX-License-Identifier: Apache-2.0
// Finds the encoders on an unknown line: sends requests that change nothing (readings, scans and identities) of the
// protocols that fit.
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
  std::string place;                    // the port: "/dev/ttyUSB0", "tcp:HOST:PORT", "spi:/dev/spidev0.0"
  std::vector<std::string> settings{};  // settings of the port, such as "latency=5"
  // greatest length of a character, in data bits; units with longer characters are not tried
  std::uint8_t most_data_bits = 16;
  Time limit{};  // time limit of the whole search for encoders
  std::function<void(const std::string&)> progress{};
  OpenLink open = open_link;
  std::function<Time()> now = os::now;  // the clock of the port: returns its present time
  // polled during the search; once it returns true, the search ends with os::Ended; empty: never
  std::function<bool()> over{};
};

struct LineFindings {
  std::vector<Candidate> candidates{};
  std::size_t requests = 0;  // number of requests that the search has sent
  std::size_t heard = 0;     // number of bytes or frames that were received after requests, without echo
  // number of bytes or frames that were received while listening, before the first request at each setting of the line
  std::size_t unsolicited = 0;
  // number of combinations of protocol, settings and encoder that were tried as an explanation of received frames
  std::size_t searches = 0;
  bool only_echo = false;         // whether in some conversation nothing but the adapter's echo was received
  std::set<std::string> lines{};  // the kinds of lines that were tried, in words
  // sentences about protocols that could not be tried, and about identities that could not be read or that contradict
  // the options
  std::vector<std::string> notes;
  bool out_of_time = false;
  bool interrupted = false;
};

/// Parses a port with its settings, "/dev/ttyUSB0?latency=50", and returns the search. Throws UsageError, also if the
/// text names a protocol.
[[nodiscard]] LineSearch parse_search(std::string_view text);

/// Searches the line for encoders and returns the findings. Throws UsageError, and os::Ended if `over` of the search
/// returns true. Throws os::Failure if the port cannot be opened, or is lost before the found encoders are asked for
/// their identities.
[[nodiscard]] LineFindings search_line(const LineSearch& search);

}  // namespace absenc::client
