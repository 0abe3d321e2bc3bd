// SPDX-License-Identifier: Apache-2.0
// The words of all findings, in one table.
#pragma once

#include <string>
#include <vector>

#include "absenc/client/doctor.hpp"

namespace absenc::client {

/// `values` stand for {0}, {1} ... in the texts of the table.
[[nodiscard]] Finding finding(Ailment ailment, const std::vector<std::string>& values = {});

}  // namespace absenc::client
