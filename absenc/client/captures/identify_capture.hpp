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
  // damage of the capture, as found by protocols that read the whole file; each damage only once
  std::vector<std::string> damages{};
  std::vector<std::string> refusals{};  // reasons why protocols could not be tried; each reason only once
};

/// Decodes the capture with each protocol, only as much of it as needed for evidence, and returns the candidates, the
/// damage of the capture and the reasons why protocols could not be tried. Throws os::Interrupted and the exceptions of
/// `progress`.
[[nodiscard]] CaptureFindings search_capture(const CaptureChoices& choices,
                                             const std::function<void(const std::string&)>& progress);

}  // namespace absenc::client
