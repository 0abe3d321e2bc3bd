// SPDX-License-Identifier: Apache-2.0
// ESL as the neutral layers see it.
#pragma once

#include "absenc/protocol/esl/profile.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

extern constinit const Unit unit;

[[nodiscard]] Profile to_profile(const Options& options);

}  // namespace absenc::esl
