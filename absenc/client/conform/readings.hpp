// SPDX-License-Identifier: Apache-2.0
// Readings of a run, and the verdicts on the clauses that need nothing else.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/client/conform.hpp"
#include "absenc/client/port/runner.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

/// Whether all bits of a clocked word are alike: a line that nobody drives shows the same.
[[nodiscard]] bool is_flat(const capture::ObservedFrame& reply);

/// Whether something came for the last request, and not only the level of a line that nobody drives.
[[nodiscard]] inline bool was_answered(const Attempted& one) { return one.answered && one.error != Error::line_stuck; }

/// Readings with one set of options, and their replies.
struct Readings {
  std::vector<Attempted> all{};
  std::uint64_t requests = 0;   // requests, pulses and transfers that were sent
  std::uint64_t answered = 0;   // of them
  std::uint64_t good = 0;       // replies, or frames that came by themselves, of which a reading was made
  std::uint64_t discarded = 0;  // damaged frames of a stream

  /// Returns the first good reading; null: there is none, or its words have nothing but bits that are all alike.
  [[nodiscard]] const Attempted* first_good() const;
};

/// Judges whether each request was answered.
void judge_answered(const Readings& readings, ClauseResult& result);

/// Judges whether frames came by themselves, up to the last reading.
void judge_streamed(const Readings& readings, ClauseResult& result);

/// Judges the answer times of good replies against the limits of a host. `latency`: the port tells times to within it.
void judge_time(const Unit& unit, const Options& options, const Readings& readings, Time latency, ClauseResult& result);

/// Judges whether a reply has one of `errors`. Kept only where a wrong bit of a good reply would show as one.
void judge_frames(const Unit& unit, const Options& options, const Readings& readings, Errors errors,
                  ClauseResult& result);

}  // namespace absenc::client
