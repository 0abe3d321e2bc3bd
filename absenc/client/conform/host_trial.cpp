// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/host_trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "absenc/client/conform/changes.hpp"
#include "absenc/client/emulation/rule_counter.hpp"

namespace absenc::client {

std::uint64_t HostTrial::length() const {
  if (phase_ == Phase::good || phase_ == Phase::last) return answers_ / 2;
  const auto demands = [](const HostClause& clause) { return clause.demand == HostDemand::after_refusal; };
  const bool is_polled = phase_ != Phase::refusal || std::ranges::any_of(host_clauses_of(unit_), demands);
  return is_polled ? requests_to_continue : 0;
}

// Returns the count, since the test began, of the events for which the present phase waits: suppressed replies,
// requests, damaged replies or answered requests.
std::uint64_t HostTrial::counted() const {
  if (phase_ == Phase::silence) return seen_.missing;
  if (phase_ == Phase::refusal) return seen_.requests.good + seen_.requests.bad;
  return phase_ == Phase::damage ? seen_.damaged : seen_.answered;
}

// Returns whether the host's requests are affected neither by a present fault nor by an earlier one.
bool HostTrial::is_calm() const {
  return phase_ == Phase::good || phase_ == Phase::over ||
         (phase_ == Phase::last && counted() - phase_begin_ >= requests_to_continue);
}

HostTrial::Fault HostTrial::look(TrialCounts seen) {
  if (is_calm()) {
    for (const RuleCount& now : seen.rules) {
      const RuleCount& before = count_of(seen_.rules, now.rule);
      RuleCount& calm = count_of(calm_, now.rule);
      calm.looked += now.looked - before.looked;
      calm.broken += now.broken - before.broken;
    }
  }
  seen_ = std::move(seen);
  if (phase_ == Phase::refusal) refused_ = counted() - phase_begin_;
  while (phase_ != Phase::over && counted() - phase_begin_ >= length()) {
    phase_ = static_cast<Phase>(static_cast<unsigned>(phase_) + 1);
    phase_begin_ = counted();
  }
  if (phase_ == Phase::silence) return Fault::silence;
  if (phase_ == Phase::refusal) return Fault::damaged_request;
  return phase_ == Phase::damage ? Fault::damage : Fault::none;
}

Conformance HostTrial::judge() const {
  Conformance conformance{.protocol = std::string(unit_.id)};
  for (const HostClause& clause : host_clauses_of(unit_)) {
    ClauseResult result{.id = clause.id,
                        .document = unit_.document,
                        .paragraph = clause.paragraph,
                        .words = clause.words,
                        .verdict = Verdict::untested};
    judge_one(clause, result);
    conformance.clauses.push_back(std::move(result));
  }
  return conformance;
}

void HostTrial::judge_one(const HostClause& clause, ClauseResult& result) const {
  switch (clause.demand) {
    case HostDemand::asks:
      return judge_requests(result);
    case HostDemand::after_silence:
      return judge_continuation(Phase::silence, "replies were missing", seen_.missing, result);
    case HostDemand::after_damage:
      return judge_continuation(Phase::damage, "replies were damaged", seen_.damaged, result);
    case HostDemand::after_refusal:
      return judge_continuation(Phase::refusal, "requests came damaged", refused_, result);
    case HostDemand::rule:
    case HostDemand::row:
      return judge_rule(clause, result);
  }
}

void HostTrial::judge_requests(ClauseResult& result) const {
  const RequestCounts& requests = seen_.requests;
  if (requests.bad != 0) {
    std::string evidence = fmt::format("{} requests, {} times something else", requests.good, requests.bad);
    if (!requests.first_bad.empty()) evidence += fmt::format(", first {}", requests.first_bad);
    return conclude(result, false, std::move(evidence));
  }
  result.evidence = requests.good == 0 ? "no request came" : "none of the requests is for this encoder";
  if (seen_.answered == 0) return;
  std::string evidence = fmt::format("{} requests, {} of them answered", requests.good, seen_.answered);
  if (requests.before != 0) evidence += fmt::format("; before the first, {} times something else", requests.before);
  conclude(result, true, std::move(evidence));
}

// Concludes `kept` only if the host sent nothing but valid requests, because random bytes may contain valid ones by
// chance.
void HostTrial::conclude_if_all_are_requests(ClauseResult& result, bool kept, std::string evidence) const {
  if (!kept || seen_.requests.bad == 0) return conclude(result, kept, std::move(evidence));
  result.evidence = fmt::format("{}, but the host also sent what is no request", evidence);
}

void HostTrial::judge_continuation(Phase phase, std::string_view what, std::uint64_t count,
                                   ClauseResult& result) const {
  result.evidence = fmt::format("the host asked for so little that no {}", what);
  if (count == 0) return;
  const bool continues = phase_ > phase;
  conclude_if_all_are_requests(
      result, continues,
      fmt::format("{} {}, {}", count, what, continues ? "and it asked on" : "then it asked no more"));
}

void HostTrial::judge_rule(const HostClause& clause, ClauseResult& result) const {
  const std::vector<RuleCount>& counts = clause.demand == HostDemand::rule ? seen_.rules : calm_;
  const auto count = std::ranges::find(counts, clause.rule, &RuleCount::rule);
  result.evidence = "the host did nothing that it is about";
  if (count == counts.end() || count->looked == 0) return;
  conclude_if_all_are_requests(result, count->broken == 0,
                               fmt::format("looked at {} times, broken {} times", count->looked, count->broken));
}

}  // namespace absenc::client
