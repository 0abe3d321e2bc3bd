// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/host_trial.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/client/conform/changes.hpp"

namespace absenc::client {

std::uint64_t HostTrial::length() const {
  if (phase_ == Phase::silence || phase_ == Phase::damage) return asked_again;
  if (phase_ == Phase::between) return asked_again;
  return answers_ / 2;
}

HostTrial::Fault HostTrial::look(std::uint64_t answered) {
  answered_ = answered;
  while (phase_ != Phase::over && answered - begun_at_ >= length()) {
    begun_at_ += length();
    phase_ = static_cast<Phase>(static_cast<unsigned>(phase_) + 1);
    if (phase_ == Phase::silence || phase_ == Phase::damage) begun_at_ = answered;  // from the next reply on
  }
  if (phase_ == Phase::silence) return Fault::silence;
  return phase_ == Phase::damage ? Fault::damage : Fault::none;
}

Conformance HostTrial::judge(const Unit& unit, std::span<const std::string> broken_rules) const {
  Conformance conformance{.protocol = std::string(unit.id)};
  for (const HostClause& clause : host_clauses_of(unit)) {
    ClauseResult result{.id = clause.id,
                        .document = unit.document,
                        .paragraph = clause.paragraph,
                        .words = clause.words,
                        .verdict = Verdict::untested,
                        .evidence = "the host did not come so far"};
    judge_one(clause, broken_rules, result);
    conformance.clauses.push_back(std::move(result));
  }
  return conformance;
}

void HostTrial::judge_one(const HostClause& clause, std::span<const std::string> broken_rules,
                          ClauseResult& result) const {
  const auto goes_on = [&](Phase phase, std::string_view what) {
    if (phase_ < phase) return;
    // The one that is on its way when the fault begins tells nothing.
    conclude(result, phase_ > phase,
             fmt::format("{} after {}", phase_ > phase ? "asked again" : "did not ask again", what));
  };
  switch (clause.demand) {
    case HostDemand::asks:
      return conclude(result, answered_ > 0, fmt::format("{} requests could be answered", answered_));
    case HostDemand::after_silence:
      return goes_on(Phase::silence, "silence");
    case HostDemand::after_damage:
      return goes_on(Phase::damage, "damaged replies");
    case HostDemand::rule: {
      if (answered_ == 0) return;
      const auto times = std::count(broken_rules.begin(), broken_rules.end(), clause.rule);
      return conclude(result, times == 0, fmt::format("broken {} times in {} requests", times, answered_));
    }
  }
}

}  // namespace absenc::client
