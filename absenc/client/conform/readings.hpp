// SPDX-License-Identifier: Apache-2.0
// Readings of a run, and the verdicts on clauses that need only readings.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/client/conform.hpp"
#include "absenc/client/port/runner.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

/// Returns whether all bits of a clocked word are equal, as on a line that nothing drives.
[[nodiscard]] bool is_flat(const capture::ObservedFrame& reply);

/// Returns whether the last request got a reply other than the constant level of an undriven line.
[[nodiscard]] inline bool was_answered(const Attempted& one) { return one.answered && one.error != Error::line_stuck; }

/// Readings with one set of options, with their replies.
struct Readings {
  std::vector<Attempted> all{};
  std::uint64_t requests = 0;   // requests, pulses and transfers that were sent
  std::uint64_t answered = 0;   // number of answered requests
  std::uint64_t good = 0;       // replies or unsolicited frames that yielded a reading
  std::uint64_t discarded = 0;  // damaged frames of a stream

  /// Returns the first good reading; null if none is good, or all good words consist of equal bits.
  [[nodiscard]] const Attempted* first_good() const;
};

/// Judges whether each request was answered.
void judge_answered(const Readings& readings, ClauseResult& result);

/// Judges whether unsolicited frames were received, up to the last reading.
void judge_streamed(const Readings& readings, ClauseResult& result);

/// Judges the time between request and good reply against the limit of a host. `latency` is the precision of the port's
/// times.
void judge_time(const Unit& unit, const Options& options, const Readings& readings, Time latency, ClauseResult& result);

/// Judges whether a reply has one of `errors`. Concludes `kept` only if a wrong bit in a good reply would show as one.
void judge_frames(const Unit& unit, const Options& options, const Readings& readings, Errors errors,
                  ClauseResult& result);

}  // namespace absenc::client
