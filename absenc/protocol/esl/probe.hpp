// SPDX-License-Identifier: Apache-2.0
// Finds the profiles that fit frames captured from a real encoder: the hardware shows what the document leaves open.
#pragma once

#include <span>

#include "absenc/protocol/esl/profile.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

/// As Unit::probe. Without a request, the reply's own control field gives the request; an empty reply proves nothing.
/// To judge sequence_step the captures must be consecutive: nothing else may have been sent to the encoder between
/// them.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink);

/// Returns changes of one or two options of `profile` that make an invalid reply valid; none if there are no such
/// changes.
[[nodiscard]] Buffer<OptionValue, 2> find_change(const Profile& profile, Bytes reply);

}  // namespace absenc::esl
