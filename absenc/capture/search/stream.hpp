// SPDX-License-Identifier: Apache-2.0
// Finds the models and options of a unit that explain a stream of bytes without requests.
#pragma once

#include <vector>

#include "absenc/capture/search/hypotheses.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::capture {

/// Splits a stream into good replies and single other bytes; may leave out bytes at its ends.
[[nodiscard]] std::vector<ObservedExchange> split_stream(const Unit& unit, const Options& options, Bytes bytes);

/// Returns the best hypothesis for a stream, or none. `duration` is the time of the recording.
[[nodiscard]] std::vector<Hypothesis> find_stream_hypotheses(const Unit& unit, Bytes bytes, Time duration);

}  // namespace absenc::capture
