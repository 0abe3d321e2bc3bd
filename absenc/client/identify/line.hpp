// SPDX-License-Identifier: Apache-2.0
// Who answers on a line that nobody knows anything about: asks in every protocol that fits, by reads that change
// nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "absenc/capture/search/hypotheses.hpp"
#include "absenc/client/way/address.hpp"

namespace absenc::client {

/// A protocol with its options, and what speaks for it.
struct Candidate {
  const Unit* unit = nullptr;
  capture::Hypothesis hypothesis{};
  std::vector<std::string> link_settings{};  // "baud=9600"; those of the user too
  bool unasked = false;                      // the encoder sends by itself
  std::string line{};                        // "RS-485 half duplex, 2.5 Mbit/s"
  std::string encoder{};                     // "address=3": which of those on the line; "": the only one
};

/// The likeliest first. `searches`: in which any of them could have been found by chance; each of them pays for all.
void rank(std::vector<Candidate>& candidates, std::size_t searches);

struct LineSearch {
  std::string place;                    // "/dev/ttyUSB0", "tcp:HOST:PORT", "spi:/dev/spidev0.0"
  std::vector<std::string> settings{};  // of the port: "latency=5"
  Time limit{};                         // of the whole search
  std::function<void(const std::string&)> progress{};
};

struct LineFindings {
  std::vector<Candidate> candidates{};
  std::size_t requests = 0;        // sent
  std::size_t heard = 0;           // bytes that came, echo taken off
  std::size_t unasked = 0;         // of them, before anything was sent
  std::size_t searches = 0;        // for what explains what came: protocols, settings, encoders
  bool only_echo = false;          // all that ever came back was what was sent
  std::set<std::string> lines{};   // that were tried
  std::vector<std::string> notes;  // what could not be tried, and why
  bool out_of_time = false;
  bool interrupted = false;
};

/// Throws os::Failure when the place cannot be opened at all, UsageError.
[[nodiscard]] LineFindings search_line(const LineSearch& search);

}  // namespace absenc::client
