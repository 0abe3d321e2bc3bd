// SPDX-License-Identifier: Apache-2.0
// Tests the clauses of a unit over a port that is already open.
#pragma once

#include "absenc/client/conform.hpp"
#include "absenc/client/port/link.hpp"

namespace absenc::client {

/// Tests the clauses over `link`; `name` is the encoder's name in commands for the user.
[[nodiscard]] Conformance conform(const EncoderAddress& address, Link link, const ConformChoices& choices,
                                  std::string_view name = {});

}  // namespace absenc::client
