// SPDX-License-Identifier: Apache-2.0
// Parses the settings that describe how an encoder is mounted in its drive.
#pragma once

#include <span>

#include "absenc/client/joint.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Sets one setting of `joint`; returns false if `setting` is no joint setting. Throws UsageError.
bool set_joint(Joint& joint, const OptionText& setting);

/// Throws UsageError if a setting of linear encoders is given to a rotary one, or the reverse.
void check_joint(std::span<const OptionText> settings, bool is_linear);

}  // namespace absenc::client
