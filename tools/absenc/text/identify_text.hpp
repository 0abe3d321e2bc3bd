// SPDX-License-Identifier: Apache-2.0
// Candidates for people and programs, and the commands to go on with.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/identify/line.hpp"

namespace absenc::tool {

using namespace client;

/// Why a search found nothing, by what came, and what to try.
[[nodiscard]] std::string advice_for(const LineFindings& findings, const LineSearch& search);

/// absenc read "tformat:/dev/ttyUSB0?model=23-bit"
[[nodiscard]] std::string read_command(const Candidate& candidate, std::string_view place);
/// absenc decode tformat --option model=23-bit
[[nodiscard]] std::string decode_command(const Candidate& candidate);

/// Prints all of them; `command` says how to go on with one. Returns the exit status.
int show_candidates(std::span<const Candidate> candidates, const std::function<std::string(const Candidate&)>& command,
                    bool json);

}  // namespace absenc::tool
