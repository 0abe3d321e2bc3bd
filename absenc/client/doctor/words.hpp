// SPDX-License-Identifier: Apache-2.0
// The words of all findings, in one table.
#pragma once

#include <string>
#include <vector>

#include "absenc/client/doctor.hpp"
#include "absenc/client/port/address.hpp"

namespace absenc::client {

/// `values` stand for {0}, {1} ... in the texts of the table.
[[nodiscard]] Finding finding(Ailment ailment, const std::vector<std::string>& values = {});

/// Replaces a cause or an action that does not fit such a place: nothing about USB is said of a network.
void suit(Finding& finding, PortKind place);

}  // namespace absenc::client
