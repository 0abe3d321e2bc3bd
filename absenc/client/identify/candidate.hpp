// SPDX-License-Identifier: Apache-2.0
// What an encoder may be: a protocol with its options, and what speaks for it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/search/hypotheses.hpp"
#include "absenc/client/row.hpp"

namespace absenc::client {

struct Candidate {
  const Unit* unit = nullptr;
  capture::Hypothesis hypothesis{};
  std::vector<std::string> link_settings{};  // "baud=9600"; those of the user too
  bool unsolicited = false;                  // the encoder sends by itself
  std::string line{};                        // "RS-485 half duplex, 2.5 Mbit/s"
  std::string encoder{};                     // "address=3": which of those on the line; "": the only one
  Answer identity{};                         // what it says of itself: its type, its serial number; of a line
};

/// Whether it is more than chance could do.
[[nodiscard]] bool is_found(const Candidate& candidate);

/// Whether `one` explains what came as well as `best` does: nothing in the frames tells them apart.
[[nodiscard]] bool is_as_likely(const Candidate& one, const Candidate& best);

/// The likeliest first. `searches`: in which any of them could have been found by chance; each of them pays for all.
void rank(std::vector<Candidate>& candidates, std::size_t searches);

/// The fewest settings ("name=value") that make these options, by a model if that is shorter.
[[nodiscard]] std::vector<std::string> settings_for(const Unit& unit, const Options& options);

/// What is behind the ? of its address: those and what the port needs.
[[nodiscard]] std::vector<std::string> all_settings(const Candidate& candidate);

/// To open it by: "tformat:/dev/ttyUSB0?model=23-bit"
[[nodiscard]] std::string address_of(const Candidate& candidate, std::string_view place);

}  // namespace absenc::client
