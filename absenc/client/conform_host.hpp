// SPDX-License-Identifier: Apache-2.0
// Tests whether a host complies with the document of a protocol.
#pragma once

#include <cstddef>
#include <functional>
#include <string_view>

#include "absenc/client/conform.hpp"
#include "absenc/client/emulate.hpp"
#include "absenc/core/time.hpp"

namespace absenc::client {

/// Length of a conformance test of a host, and its callbacks.
struct ConformHostChoices {
  std::size_t answers = 100;  ///< Number of replies, half before the first and half after the last fault; at least 2.
  /// Silence of the host after which the test ends; it is measured once the host has sent something.
  Time patience = std::chrono::seconds(10);
  std::function<void(const Emulation&)> ready{};  ///< Called with the running emulation when the host can connect.
  /// Polled during the test; true ends it. Empty: never.
  std::function<bool()> over{};
};

/// Tests a host with a virtual encoder that also makes faults, and returns the verdicts. `text` and `place` are those
/// of `emulate`. Throws UsageError, os::Interrupted and exceptions of the port.
[[nodiscard]] Conformance conform_host(std::string_view text, const EmulateChoices& place = {},
                                       const ConformHostChoices& choices = {});

}  // namespace absenc::client
