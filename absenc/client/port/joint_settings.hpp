// SPDX-License-Identifier: Apache-2.0
// Parses the settings that describe how an encoder is mounted in its drive.
#pragma once

#include <span>

#include "absenc/client/joint.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Applies the setting if it is a joint setting; returns whether it is one. Throws UsageError.
bool set_joint(Joint& joint, const OptionText& setting);

/// Throws UsageError for a setting of linear encoders given to a rotary one, or the reverse, because it would be
/// ignored.
void check_joint(std::span<const OptionText> settings, bool is_linear);

}  // namespace absenc::client
