// SPDX-License-Identifier: Apache-2.0
// The settings behind an encoder that say how it sits in its drive.
#pragma once

#include <span>

#include "absenc/client/joint.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Takes the setting, if it is one of these; returns whether it is. Throws UsageError.
bool set_joint(Joint& joint, const OptionText& setting);

/// Refuses a setting that would be ignored, because it is one of linear encoders and this one turns, or the reverse.
/// Throws UsageError.
void check_joint(std::span<const OptionText> settings, bool is_linear);

}  // namespace absenc::client
