// SPDX-License-Identifier: Apache-2.0
// A campaign in which positions are confirmed, beside what frame checks and speed limit can let through.
#pragma once

#include "absenc/client/campaign.hpp"
#include "absenc/client/campaign/rough_setup.hpp"

namespace absenc::client {

/// Reads a turning shaft, one reading behind the other. Counts readings, exchanges and failures in `result`.
[[nodiscard]] Guarded read_guarded(const Unit& unit, const Options& options, const Rates& rates,
                                   const CampaignChoices& choices, CampaignResult& result);

}  // namespace absenc::client
