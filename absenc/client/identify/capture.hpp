// SPDX-License-Identifier: Apache-2.0
// Finds the protocols that explain the frames of a capture file.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absenc/client/captures/run.hpp"
#include "absenc/client/identify/line.hpp"

namespace absenc::client {

struct CaptureFindings {
  std::vector<Candidate> candidates{};
  std::vector<std::string> damages{};   // damage in the part of the capture that was read, each once
  std::vector<std::string> refusals{};  // why a protocol could not be tried, each reason once
};

/// Reads the capture until the evidence suffices. Throws UsageError, Failure, os::Interrupted.
[[nodiscard]] CaptureFindings search_capture(const CaptureChoices& choices,
                                             const std::function<void(const std::string&)>& progress);

}  // namespace absenc::client
