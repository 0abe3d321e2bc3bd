// SPDX-License-Identifier: Apache-2.0
// Runs a campaign with confirmed positions and computes how many wrong positions pass both the frame checks and the
// speed limit.
#pragma once

#include "absenc/client/campaign.hpp"
#include "absenc/client/campaign/rough_setup.hpp"

namespace absenc::client {

/// Reads a shaft that turns steadily, or rests if `choices.rpm` is 0, until at least `choices.exchanges` exchanges are
/// done. Counts readings, exchanges, failures and changed encoders in `result`, and returns the shares of confirmed and
/// wrong positions.
[[nodiscard]] Guarded read_guarded(const Unit& unit, const Options& options, const Rates& rates,
                                   const CampaignChoices& choices, CampaignResult& result);

}  // namespace absenc::client
