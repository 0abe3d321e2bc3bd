// SPDX-License-Identifier: Apache-2.0
// Which profiles fit frames captured from a real encoder: what the document leaves open, the hardware tells.
#pragma once

#include <span>

#include "absenc/protocol/esl/profile.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

/// As Unit::probe. Without a request, the reply's own control field says what was asked; an empty reply proves nothing.
/// Captures must follow each other without a gap for sequence_step to be judged: nothing else may have been sent to the
/// encoder between them.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink);

/// What to change in `profile`, in one option or two, so that a reply that it does not explain is good; nothing where
/// nothing was found.
[[nodiscard]] Buffer<OptionValue, 2> find_change(const Profile& profile, Bytes reply);

}  // namespace absenc::esl
