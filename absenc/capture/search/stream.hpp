// SPDX-License-Identifier: Apache-2.0
// Finds the models and options of a unit that explain a stream of bytes without requests.
#pragma once

#include <vector>

#include "absenc/capture/search/hypotheses.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::capture {

/// Splits a stream into replies that the unit accepts, and returns them in order. Each byte outside a reply is an
/// exchange of its own, because a reply might have begun there. Only bytes that may belong to a reply cut by the
/// beginning or the end of the stream are left out.
[[nodiscard]] std::vector<ObservedExchange> split_stream(const Unit& unit, const Options& options, Bytes bytes);

/// Returns the best hypothesis for a stream; none if no options explain at least three frames. If the unit has an
/// option for it, its options state that the encoder sends unsolicited frames, and if possible how often, computed from
/// `duration`, the time of the recording.
[[nodiscard]] std::vector<Hypothesis> find_stream_hypotheses(const Unit& unit, Bytes bytes, Time duration);

}  // namespace absenc::capture
