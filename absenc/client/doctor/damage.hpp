// SPDX-License-Identifier: Apache-2.0
// Analyses damaged replies for parts of good frames.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/doctor/judges.hpp"

namespace absenc::client {

using All = std::vector<const Attempted*>;

/// Returns the attempts for which `is` is true, in order.
template <class Is>
[[nodiscard]] All chosen(const All& all, const Is& is) {
  All those;
  std::copy_if(all.begin(), all.end(), std::back_inserter(those), [&](const Attempted* one) { return is(*one); });
  return those;
}

/// Returns whether the reply is good with the user's options. With an empty request: a good reply to any request.
[[nodiscard]] bool decodes(const Case& one, const Frame& request, const Frame& reply);

/// Returns whether a good reply has other bytes beside it: the request before it, a few bytes before or after it, or
/// the same reply again. Only for lines of characters.
[[nodiscard]] bool has_good_part(const Case& one, const Attempted& attempt);

/// Returns whether fewer bytes arrived than the beginning of the frame requires. Only for lines of characters.
[[nodiscard]] bool is_cut(const Case& one, const Attempted& attempt);

/// Returns how many of the replies become good if one bit is flipped; 0 if random replies of the same length become
/// good as often, because a short checksum accepts many by chance.
[[nodiscard]] std::size_t mended_by_one_bit(const Case& one, const All& all);

/// Returns the change that an adapter, a driver or a device server made to nearly all these damaged replies, or beside
/// the good ones. Undoing it makes far more of them good than chance would. Only for lines of characters.
[[nodiscard]] std::optional<Finding> damage_by_adapter(const Case& one, const All& all);

/// Finds text of a modem, a console or a GPS receiver; nothing if the unit's own replies are similar text.
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
