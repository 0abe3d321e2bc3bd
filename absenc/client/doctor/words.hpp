// SPDX-License-Identifier: Apache-2.0
// The texts of the findings of doctor.
#pragma once

#include <string>
#include <vector>

#include "absenc/client/doctor.hpp"
#include "absenc/client/port/address.hpp"

namespace absenc::client {

/// Returns a finding of this kind; `values` replace {0}, {1} ... in its texts.
[[nodiscard]] Finding finding(FindingKind finding_kind, const std::vector<std::string>& values = {});

/// Replaces texts of the finding that do not fit this kind of port.
void suit(Finding& finding, PortKind place);

}  // namespace absenc::client
