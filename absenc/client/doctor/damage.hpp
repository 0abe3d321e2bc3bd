// SPDX-License-Identifier: Apache-2.0
// The remains of good frames in damaged replies.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/doctor/judges.hpp"

namespace absenc::client {

using All = std::vector<const Attempted*>;

/// Those of which `is` is true, in their order.
template <class Is>
[[nodiscard]] All chosen(const All& all, const Is& is) {
  All those;
  std::copy_if(all.begin(), all.end(), std::back_inserter(those), [&](const Attempted* one) { return is(*one); });
  return those;
}

/// Whether the unit takes this reply for a good one with the options of the user. An empty request: to any request.
[[nodiscard]] bool decodes(const Case& one, const Frame& request, const Frame& reply);

/// Whether a good reply to the request came with other bytes beside it: the request before it, a few bytes before or
/// behind it, or the same again. Links of characters only.
[[nodiscard]] bool has_good_part(const Case& one, const Attempted& attempt);

/// Whether the frame that begins the reply, or the protocol, needs more bytes than came. Links of characters only.
[[nodiscard]] bool is_cut(const Case& one, const Attempted& attempt);

/// Replies that came behind another request than their own.
struct Belated {
  All requests{};   // behind which they came
  Time lateness{};  // of the latest
};

/// Finds good replies to a request that was not answered in time, behind or before the reply to a later one, or in its
/// place. Links of characters only.
[[nodiscard]] Belated belated_replies(const Case& one);

/// How many of the replies become good when one of their bits is flipped; 0 when these are no more than of random
/// replies of the same length, for a short checksum lets many pass by chance.
[[nodiscard]] std::size_t mended_by_one_bit(const Case& one, const All& all);

/// Returns what an adapter, a driver or a device server did to the bytes of nearly all these damaged replies, or beside
/// the good ones: undone, they are good, and by far more of them than chance makes so. Links of characters only.
[[nodiscard]] std::optional<Finding> damage_by_adapter(const Case& one, const All& all);

/// Finds text of a modem, a console or a GPS receiver. Nothing where the unit's own replies are text that looks so.
[[nodiscard]] std::optional<Finding> text_of_others(const Case& one, Bytes bytes);

/// Finds another model or other options of the unit, with which these damaged replies are good.
[[nodiscard]] std::optional<Finding> other_settings(const Case& one, const All& all);

/// Returns the settings ("model=23-bit") that make `wanted` of the options `now`; none where both are the same.
[[nodiscard]] std::vector<std::string> settings_to_set(const Unit& unit, const Options& wanted, const Options& now);
/// Returns these options in words: "model=23-bit", or "the usual settings".
[[nodiscard]] std::string said_settings(const Unit& unit, const Options& options);

/// Finds another checksum than the unit's, which is good in all these damaged replies.
[[nodiscard]] std::optional<Finding> other_checksum(const Case& one, const All& all);

}  // namespace absenc::client
