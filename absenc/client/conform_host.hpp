// SPDX-License-Identifier: Apache-2.0
// Whether a host keeps to the document of a protocol: a virtual encoder is played to it, and what it does is judged.
#pragma once

#include <cstddef>
#include <functional>
#include <string_view>

#include "absenc/client/conform.hpp"
#include "absenc/client/emulate.hpp"
#include "absenc/core/time.hpp"

namespace absenc::client {

/// What a conformance test of a host looks at, and how long it lasts.
struct ConformHostChoices {
  std::size_t answers = 100;                      ///< so many requests are answered well, at least 2
  Time patience = std::chrono::seconds(10);       ///< so long a silence of the host is its last
  std::function<void(const Emulation&)> ready{};  ///< the host can connect now
  std::function<bool()> over{};                   ///< from the moment on in which it is true, it is judged
};

/// Replies stay away for a while and are damaged for a while; the host has to go on. Returns when it was answered so
/// often, or was silent for so long. `text` and `place` as those of `emulate`. Throws UsageError, what the port throws,
/// os::Interrupted.
[[nodiscard]] Conformance conform_host(std::string_view text, const EmulateChoices& place = {},
                                       const ConformHostChoices& choices = {});

}  // namespace absenc::client
