// SPDX-License-Identifier: Apache-2.0
// Finds the profiles that fit captured frames, which show what the document leaves open.
#pragma once

#include <span>

#include "absenc/protocol/esl/profile.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

/// Finds the options that fit all captures, as Unit::probe. For sequence_step the captures must be consecutive.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink);

/// Returns new values of one or two options that explain an invalid reply; empty if none do.
[[nodiscard]] Buffer<OptionValue, 2> find_change(const Profile& profile, Bytes reply);

}  // namespace absenc::esl
