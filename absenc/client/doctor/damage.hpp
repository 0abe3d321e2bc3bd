// SPDX-License-Identifier: Apache-2.0
// Analyses damaged replies: good frames in them, changes by adapters, other settings and checksums.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/doctor/judges.hpp"

namespace absenc::client {

using All = std::vector<const Attempted*>;

/// Returns the attempts of `all` for which `is` returns true, in their order.
template <class Is>
[[nodiscard]] All chosen(const All& all, const Is& is) {
  All those;
  std::copy_if(all.begin(), all.end(), std::back_inserter(those), [&](const Attempted* one) { return is(*one); });
  return those;
}

/// Returns the attempts in which something was received, but no good reply, in their order.
[[nodiscard]] All damaged(const std::vector<Attempted>& attempts);

/// Returns whether the reply is good with the user's options. With an empty request, a good reply to any request
/// counts.
[[nodiscard]] bool decodes(const Case& one, const Frame& request, const Frame& reply);

/// Returns whether the received bytes contain a good reply and other bytes besides: the request before the reply, a
/// second good reply, or before or after the reply at most half as many bytes as it has. Only for lines of characters.
[[nodiscard]] bool has_good_part(const Case& one, const Attempted& attempt);

/// Returns whether the attempt received fewer bytes than the beginning of the frame requires. Only for lines of
/// characters.
[[nodiscard]] bool is_cut(const Case& one, const Attempted& attempt);

/// Returns how many of the first 24 of these replies that have bytes become good if one bit is flipped. Returns 0 on
/// CAN, for fewer than five replies, and if so many random replies of the same lengths become good as well that chance
/// may be the reason.
[[nodiscard]] std::size_t mended_by_one_bit(const Case& one, const All& all);

/// Finds a change of bytes by an adapter, a driver or a device server, in these damaged replies or in the good replies
/// of the examination. Returns nothing if no change explains them, or if chance may do so. Only for lines of
/// characters.
[[nodiscard]] std::optional<Finding> damage_by_adapter(const Case& one, const All& all);

/// Finds text of a modem, a console or a GPS receiver in the bytes: a word such as "login:" or "NO CARRIER", or, if the
/// unit's own replies are not text, lines of printable characters. Otherwise returns nothing.
[[nodiscard]] std::optional<Finding> text_of_others(const Case& one, Bytes bytes);

/// Finds another model or other options of the unit with which at least 9 of 10 of the first 32 of these replies are
/// good. Returns nothing if there are none, if chance may be the reason, or if there are fewer than four replies.
[[nodiscard]] std::optional<Finding> other_settings(const Case& one, const All& all);

/// Returns the settings ("model=23-bit") that change the options `now` into `wanted`; empty if both are equal.
[[nodiscard]] std::vector<std::string> settings_to_set(const Unit& unit, const Options& wanted, const Options& now);
/// Returns how well the encoder could be read with the user's settings: "no good reply", "3 of 24 replies good".
[[nodiscard]] std::string good_as_said(std::size_t good, std::size_t tried);
/// Returns options as the settings that give them, "model=23-bit", or "the usual settings".
[[nodiscard]] std::string said_settings(const Unit& unit, const Options& options);

/// Finds a checksum of another kind than the unit's that explains these damaged replies. Returns nothing if there is
/// none, if chance may be the reason, or if less than 80 % of the replies have the error bad_checksum.
[[nodiscard]] std::optional<Finding> other_checksum(const Case& one, const All& all);

}  // namespace absenc::client
