// SPDX-License-Identifier: Apache-2.0
// Runs a campaign with confirmed positions.
#pragma once

#include "absenc/client/campaign.hpp"
#include "absenc/client/campaign/rough_setup.hpp"

namespace absenc::client {

/// Reads an encoder whose shaft turns at `choices.rpm`, which must have a value. Adds its counts to `result`, and
/// returns the shares of confirmed and wrong positions.
[[nodiscard]] Guarded read_guarded(const Unit& unit, const Options& options, const Rates& rates,
                                   const CampaignChoices& choices, CampaignResult& result);

}  // namespace absenc::client
