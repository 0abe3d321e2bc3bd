// SPDX-License-Identifier: Apache-2.0
// Which protocols explain what is in a capture file.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absenc/client/captures/run.hpp"
#include "absenc/client/identify/line.hpp"

namespace absenc::client {

struct CaptureFindings {
  std::vector<Candidate> candidates{};
  std::vector<std::string> damages{};   // of the capture, as far as it was read, each once
  std::vector<std::string> refusals{};  // why a protocol could not be looked for, each once
};

/// As much of the capture as it takes. Throws UsageError, Failure, os::Interrupted.
[[nodiscard]] CaptureFindings search_capture(const CaptureChoices& choices,
                                             const std::function<void(const std::string&)>& progress);

}  // namespace absenc::client
