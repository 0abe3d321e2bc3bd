// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absenc/client/conform.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::client {

/// Converts the results to
/// {"ok","protocol","verdict","kept","broken","untested","clauses":[{"id","document","paragraph",
/// "words","verdict","evidence"}],"left"}.
[[nodiscard]] Json to_json(const Conformance& conformance);

}  // namespace absenc::client
