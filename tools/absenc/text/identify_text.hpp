// SPDX-License-Identifier: Apache-2.0
// Prints the candidates of `identify` as text or JSON, with the next commands.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/identify/line.hpp"

namespace absenc::tool {

using namespace client;

/// Returns the reason why a search found nothing, concluded from the received bytes, and what the user can try.
[[nodiscard]] std::string advice_for(const LineFindings& findings, const LineSearch& search);

/// Returns the command that reads a candidate: absenc read "tformat:/dev/ttyUSB0?model=23-bit".
[[nodiscard]] std::string read_command(const Candidate& candidate, std::string_view place);
/// Returns the command that decodes a candidate: absenc decode tformat --option model=23-bit.
[[nodiscard]] std::string decode_command(const Candidate& candidate);

/// Notes of a search, and whether it was complete.
struct SearchNotes {
  std::vector<std::string> notes{};  // sentences about protocols and data that could not be tried or read
  bool is_complete = true;           // false: the search was ended before everything was tried
};

/// Prints the candidates of a search; as JSON also its notes. Returns exit_good only if the first candidate cannot be
/// explained by chance.
int show_candidates(std::span<const Candidate> candidates, const SearchNotes& search,
                    const std::function<std::string(const Candidate&)>& command, bool json);

}  // namespace absenc::tool
