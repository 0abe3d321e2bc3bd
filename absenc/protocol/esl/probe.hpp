// SPDX-License-Identifier: Apache-2.0
// Finds the profiles that fit frames captured from a real encoder: the hardware shows what the document leaves open.
#pragma once

#include <span>

#include "absenc/protocol/esl/profile.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

/// Finds the options that fit all captures, as Unit::probe. If a capture has no request, the control field of the reply
/// gives it; a capture without a reply proves nothing. To judge sequence_step the captures must be consecutive: nothing
/// else may have been sent to the encoder between them.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink);

/// Returns new values of one or two options of `profile` with which an invalid reply is valid, or the other
/// parity_scope if it explains a reported parity error; empty if no such change is found, or if the reply is valid or
/// empty.
[[nodiscard]] Buffer<OptionValue, 2> find_change(const Profile& profile, Bytes reply);

}  // namespace absenc::esl
