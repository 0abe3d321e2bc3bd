// SPDX-License-Identifier: Apache-2.0
// The texts of all findings, in one table.
#pragma once

#include <string>
#include <vector>

#include "absenc/client/doctor.hpp"
#include "absenc/client/port/address.hpp"

namespace absenc::client {

/// Returns a finding; `values` replace {0}, {1} ... in its texts.
[[nodiscard]] Finding finding(FindingKind finding_kind, const std::vector<std::string>& values = {});

/// Replaces a cause or an action that does not fit the place: no advice about USB for a network.
void suit(Finding& finding, PortKind place);

}  // namespace absenc::client
