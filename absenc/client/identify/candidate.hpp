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
  std::vector<std::string> link_settings{};  // port settings such as "baud=9600", including those of the user
  bool unsolicited = false;                  // whether the encoder sends frames unsolicited
  std::string line{};                        // the line in words, "RS-485 half duplex, 2.5 Mbit/s"
  // setting with the address of the encoder, "address=3"; "": its address was not found or it has none
  std::string encoder{};
  Answer identity{};  // identity that the encoder on a line reports: type, serial number; empty for captures
};

/// Returns whether the candidate's evidence is too strong for chance.
[[nodiscard]] bool is_found(const Candidate& candidate);

/// Returns whether the evidence for `one` is at least about as strong as that for `best`, and both candidates are
/// proven or neither of them is.
[[nodiscard]] bool is_as_likely(const Candidate& one, const Candidate& best);

/// Sorts the candidates, the likeliest first. `searches` is the number of searches that could each find a candidate by
/// chance; it weakens the evidence of each candidate.
void rank(std::vector<Candidate>& candidates, std::size_t searches);

/// Returns a short list of settings ("name=value") that give these options; empty for the defaults.
[[nodiscard]] std::vector<std::string> settings_for(const Unit& unit, const Options& options);

/// Returns the settings that follow ? in the candidate's address: those of the options and of the port.
[[nodiscard]] std::vector<std::string> all_settings(const Candidate& candidate);

/// Returns the address of the candidate at the port `place`: "tformat:/dev/ttyUSB0?model=23-bit".
[[nodiscard]] std::string address_of(const Candidate& candidate, std::string_view place);

}  // namespace absenc::client
