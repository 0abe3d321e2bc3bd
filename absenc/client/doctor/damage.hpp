// SPDX-License-Identifier: Apache-2.0
// Analyses damaged replies.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/doctor/judges.hpp"

namespace absenc::client {

using All = std::vector<const Attempted*>;

/// Returns those readings of `all` for which `is` returns true, in their order.
template <class Is>
[[nodiscard]] All chosen(const All& all, const Is& is) {
  All those;
  std::copy_if(all.begin(), all.end(), std::back_inserter(those), [&](const Attempted* one) { return is(*one); });
  return those;
}

/// Returns the readings in which something was received, but no good reply, in their order.
[[nodiscard]] All damaged(const std::vector<Attempted>& attempts);

[[nodiscard]] bool decodes(const Case& one, const Frame& request, const Frame& reply);

/// Returns whether the received bytes contain a good reply and further bytes. Only for lines of characters.
[[nodiscard]] bool has_good_part(const Case& one, const Attempted& attempt);

/// Returns whether the reply ended before the length that its first bytes state. Only for lines of characters.
[[nodiscard]] bool is_cut(const Case& one, const Attempted& attempt);

/// Returns how many damaged replies become good if one bit is flipped. Returns 0 if there are fewer than five damaged
/// replies, or if about as many random replies would become good, too.
[[nodiscard]] std::size_t mended_by_one_bit(const Case& one, const All& all);

/// Finds the change that an adapter, a driver or a device server has made to the bytes of the replies; returns nothing
/// if there is none. Only for lines of characters.
[[nodiscard]] std::optional<Finding> damage_by_adapter(const Case& one, const All& all);

[[nodiscard]] std::optional<Finding> text_of_others(const Case& one, Bytes bytes);

[[nodiscard]] std::optional<Finding> other_settings(const Case& one, const All& all);

/// Returns the settings, such as "model=23-bit", that must be added to change the options `now` into the options
/// `wanted`.
[[nodiscard]] std::vector<std::string> settings_to_set(const Unit& unit, const Options& wanted, const Options& now);
/// Returns a phrase that says how many readings were good: "no good reply", "3 of 24 replies good".
[[nodiscard]] std::string good_as_said(std::size_t good, std::size_t tried);
/// Returns the settings that select these options, such as "model=23-bit"; for the default options "the usual
/// settings".
[[nodiscard]] std::string said_settings(const Unit& unit, const Options& options);

[[nodiscard]] std::optional<Finding> other_checksum(const Case& one, const All& all);

}  // namespace absenc::client
