// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/host_trial.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/client/conform/changes.hpp"
#include "absenc/client/emulation/rule_counter.hpp"

namespace absenc::client {

std::uint64_t HostTrial::length() const {
  if (phase_ == Phase::silence || phase_ == Phase::damage) return asked_again;
  if (phase_ == Phase::between) return asked_again;
  return answers_ / 2;
}

// What was given up for a fault may show in the first requests behind it.
bool HostTrial::is_calm() const {
  return phase_ == Phase::good || phase_ == Phase::over ||
         (phase_ == Phase::last && answered_ - begun_at_ >= asked_again);
}

HostTrial::Fault HostTrial::look(std::uint64_t answered, std::span<const RuleCount> rules) {
  if (is_calm()) {
    for (const RuleCount& now : rules) {
      const RuleCount& before = count_of(rules_, now.rule);
      RuleCount& calm = count_of(calm_, now.rule);
      calm.looked += now.looked - before.looked;
      calm.broken += now.broken - before.broken;
    }
  }
  rules_.assign(rules.begin(), rules.end());
  answered_ = answered;
  while (phase_ != Phase::over && answered - begun_at_ >= length()) {
    begun_at_ += length();
    phase_ = static_cast<Phase>(static_cast<unsigned>(phase_) + 1);
    if (phase_ == Phase::silence || phase_ == Phase::damage) begun_at_ = answered;  // from the next reply on
  }
  if (phase_ == Phase::silence) return Fault::silence;
  return phase_ == Phase::damage ? Fault::damage : Fault::none;
}

Conformance HostTrial::judge(const Unit& unit) const {
  Conformance conformance{.protocol = std::string(unit.id)};
  for (const HostClause& clause : host_clauses_of(unit)) {
    ClauseResult result{.id = clause.id,
                        .document = unit.document,
                        .paragraph = clause.paragraph,
                        .words = clause.words,
                        .verdict = Verdict::untested,
                        .evidence = "the host did not come so far"};
    judge_one(clause, result);
    conformance.clauses.push_back(std::move(result));
  }
  return conformance;
}

void HostTrial::judge_one(const HostClause& clause, ClauseResult& result) const {
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
    case HostDemand::rule:
    case HostDemand::row: {
      result.need_not_come = true;
      if (answered_ == 0) return;
      const std::vector<RuleCount>& counts = clause.demand == HostDemand::rule ? rules_ : calm_;
      const auto count = std::ranges::find(counts, clause.rule, &RuleCount::rule);
      result.evidence = "the host did nothing that it is about";
      if (count == counts.end() || count->looked == 0) return;
      return conclude(result, count->broken == 0,
                      fmt::format("looked at {} times, broken {} times", count->looked, count->broken));
    }
  }
}

}  // namespace absenc::client
