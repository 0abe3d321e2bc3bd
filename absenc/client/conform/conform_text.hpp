// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absenc/client/conform.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::client {

[[nodiscard]] Json to_json(const Conformance& conformance);

}  // namespace absenc::client
