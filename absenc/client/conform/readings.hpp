// SPDX-License-Identifier: Apache-2.0
// Readings of a conformance test, and the verdicts on clauses that need only readings.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/client/conform.hpp"
#include "absenc/client/port/runner.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

/// Returns whether all bits of a clocked word are equal; false for a frame of bytes.
[[nodiscard]] bool is_flat(const capture::ObservedFrame& reply);

/// Returns whether the reading got a reply; the constant level of an undriven line is none.
[[nodiscard]] inline bool was_answered(const Attempted& one) { return one.answered && one.error != Error::line_stuck; }

/// Readings that were taken with one set of options, and their counts.
struct Readings {
  std::vector<Attempted> all{};
  std::uint64_t requests = 0;  // number of requests, pulses and transfers that were sent
  std::uint64_t answered = 0;  // number of requests that got a reply
  std::uint64_t good = 0;      // number of requests whose readings were good, or number of good unsolicited frames
  std::uint64_t late = 0;      // number of requests whose replies began after a host's timeout
  // number of replies that came while an earlier request was not answered: they may be late replies to that request
  std::uint64_t in_doubt = 0;
  std::uint64_t good_in_doubt = 0;  // number of requests of `good` whose replies are in doubt
  std::uint64_t discarded = 0;      // number of damaged frames in a stream

  /// Returns the first good reading that is no clocked word of equal bits; null if there is none.
  [[nodiscard]] const Attempted* first_good() const;
};

/// Stores the verdict on whether the encoder replied to each request.
void judge_answered(const Readings& readings, ClauseResult& result);

/// Stores the verdict on whether unsolicited frames were received until the last reading.
void judge_streamed(const Readings& readings, ClauseResult& result);

/// Stores the verdict on whether replies came in time. The clause is untested if the port cannot measure that.
void judge_time(const Unit& unit, const Options& options, const Readings& readings, ClauseResult& result);

void judge_frames(const Unit& unit, const Options& options, const Readings& readings, Errors errors,
                  ClauseResult& result);

}  // namespace absenc::client
