// SPDX-License-Identifier: Apache-2.0
// A possible identification of an encoder: a protocol with its options, and the evidence for it.
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
  std::vector<std::string> link_settings{};  // port settings such as "baud=9600", including the user's
  bool unsolicited = false;                  // the encoder sends by itself
  std::string line{};                        // "RS-485 half duplex, 2.5 Mbit/s"
  std::string encoder{};  // address setting of the encoder on the line, "address=3"; "": the only one
  Answer identity{};      // identity that the encoder reports: type, serial number; only for a line, not for captures
};

/// Returns whether the evidence is beyond chance.
[[nodiscard]] bool is_found(const Candidate& candidate);

/// Returns whether `one` explains the frames as well as `best`, so that the frames cannot distinguish them.
[[nodiscard]] bool is_as_likely(const Candidate& one, const Candidate& best);

/// Sorts the candidates, the likeliest first. `searches` is the number of searches that could find one by chance; the
/// evidence of each candidate is reduced by it.
void rank(std::vector<Candidate>& candidates, std::size_t searches);

/// Returns the fewest settings ("name=value") that give these options, with a model if that is shorter.
[[nodiscard]] std::vector<std::string> settings_for(const Unit& unit, const Options& options);

/// Returns the settings behind ? of the candidate's address: those of the options and of the port.
[[nodiscard]] std::vector<std::string> all_settings(const Candidate& candidate);

/// Returns the address of the candidate: "tformat:/dev/ttyUSB0?model=23-bit".
[[nodiscard]] std::string address_of(const Candidate& candidate, std::string_view place);

}  // namespace absenc::client
