// SPDX-License-Identifier: Apache-2.0
// Functions for verdicts on clauses: requests, errors of replies, and evidence.
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

// greatest number of bytes of a request; on CAN, of characters of its text
inline constexpr std::size_t longest_request = 64;

/// Returns the request that a test of the clause must send, as bytes, on CAN as text; empty if the clause names no
/// request.
[[nodiscard]] std::vector<std::uint8_t> request_of_ask(const Unit& unit, const Options& options, const Ask& ask);

inline void conclude(ClauseResult& result, bool kept, std::string evidence) {
  result.verdict = kept ? Verdict::kept : Verdict::broken;
  result.evidence = std::move(evidence);
}

/// Returns the reason why the clause does not apply with these options; "" if it applies.
[[nodiscard]] std::string reason_against(const Unit& unit, const Options& options, const Clause& clause);

/// Changes a good exchange in several ways (a flipped bit, another length, another request) and returns for how many of
/// them the decoder reports one of `errors`.
[[nodiscard]] std::size_t detected_changes(const Unit& unit, const Options& options,
                                           const capture::ObservedExchange& good, Errors errors);

/// Returns the error of the exchange's reply if it is taken for a reply to `command`, or, if `command` is "", for a
/// reply to the exchange's own request.
[[nodiscard]] Error reply_error(const Unit& unit, const Options& options, std::string_view command,
                                const capture::ObservedExchange& exchange);

/// Returns the address to which the request is sent; nothing if there is none.
[[nodiscard]] std::optional<std::int64_t> encoder_of(const Unit& unit, const Options& options, const Frame& request);

/// Returns request and reply as text, "to 9a came 1a 40 ...".
[[nodiscard]] std::string exchange_text(LinkKind link, const Frame& request, const Frame& reply);

}  // namespace absenc::client
