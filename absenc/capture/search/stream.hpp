// SPDX-License-Identifier: Apache-2.0
// Which models and options of a unit explain bytes that came without being asked for.
#pragma once

#include <vector>

#include "absenc/capture/search/hypotheses.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::capture {

/// Cuts a stream into replies, as far as the unit takes them for good. Every byte that belongs to none is an exchange
/// of its own: it was a chance for a good one. Only what may be a reply that the beginning or the end cuts is left out.
[[nodiscard]] std::vector<ObservedExchange> split_stream(const Unit& unit, const Options& options, Bytes bytes);

/// As `find_hypotheses`. The options then say that the encoder sends by itself, and how often when they can: as often
/// as in the time in which the bytes came.
[[nodiscard]] std::vector<Hypothesis> find_stream_hypotheses(const Unit& unit, Bytes bytes, Time duration);

}  // namespace absenc::capture
