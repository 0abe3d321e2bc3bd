// SPDX-License-Identifier: Apache-2.0
// Finds the profiles (values of the options) that fit captured frames. The options decide properties of the encoder
// that the document leaves open.
#pragma once

#include <span>

#include "absenc/protocol/esl/profile.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

/// Finds the options that fit all captures, as Unit::probe describes. For the option sequence_step the captures must be
/// consecutive.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink);

/// Returns new values of one or two options under which an invalid reply is valid; empty if there are none.
[[nodiscard]] Buffer<OptionValue, 2> find_change(const Profile& profile, Bytes reply);

}  // namespace absenc::esl
