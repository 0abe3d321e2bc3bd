// SPDX-License-Identifier: Apache-2.0
// The evidence of a verdict: how often the run saw the thing that a clause is about.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/search/evidence.hpp"
#include "absenc/client/conform.hpp"
#include "absenc/client/port/runner.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

inline constexpr std::size_t longest_request = 64;  // bytes, of a unit or as text

inline void conclude(ClauseResult& result, bool kept, std::string evidence) {
  result.verdict = kept ? Verdict::kept : Verdict::broken;
  result.evidence = std::move(evidence);
}

/// Why these options leave out what the clause is about: "" where they do not.
[[nodiscard]] std::string reason_against(const Unit& unit, const Options& options, const Clause& clause);

/// In how many ways a good reply can be changed that then breaks it by one of these errors: a wrong bit, a missing or
/// an additional byte, or that it answers another request. 0: these options have no such check.
[[nodiscard]] std::size_t changes_noticed(const Unit& unit, const Options& options,
                                          const capture::ObservedExchange& good, Errors errors);

/// Returns the error of the reply as one to the request of this command; "": to its own request.
[[nodiscard]] Error reply_error(const Unit& unit, const Options& options, std::string_view command,
                                const capture::ObservedExchange& exchange);

/// Whose request this is, as it says itself. Nothing: it is none, or names nobody.
[[nodiscard]] std::optional<std::int64_t> encoder_of(const Unit& unit, const Options& options, const Frame& request);

/// "to 9a came 1a 40 ..."
[[nodiscard]] std::string what_came(LinkKind link, const Frame& request, const Frame& reply);

}  // namespace absenc::client
