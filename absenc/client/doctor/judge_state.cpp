// SPDX-License-Identifier: Apache-2.0
// Judges the state that the encoder reports.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/doctor/judges.hpp"
#include "absenc/client/doctor/words.hpp"
#include "absenc/client/reading.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

// A flag that at least one reading reported as raised.
struct RaisedFlag {
  const FlagInfo* flag = nullptr;
  bool is_alarm = false;
  std::set<std::string_view> channels{};  // names of the fields, one for each channel, that report the flag
  const Reading* last = nullptr;          // the last of the readings that report the flag as raised
  std::size_t readings = 0;
  // number of readings with this flag raised and with an invalid position or invalid turns; 0 if these readings may be
  // damaged replies
  std::size_t invalid = 0;
};

bool is_invalid(const Reading& reading) {
  return reading.singleturn_validity() == Validity::invalid || reading.multiturn_validity() == Validity::invalid;
}

// Returns the raised alarms of both channels, joined as bits of the first channel's field.
std::uint32_t alarms_of_either(const Unit& unit, const Reading& reading) {
  std::uint32_t bits = 0;
  for (const Flags& flags : alarms_of(unit, reading)) bits |= flags.bits;
  return bits;
}

void count_flags(const std::vector<Flags>& all, bool is_alarm, const Reading& reading, std::uint32_t alarms,
                 std::vector<RaisedFlag>& counts) {
  for (const Flags& flags : all) {
    for (const FlagInfo* flag : raised(*flags.field, flags.bits)) {
      if (!is_alarm && (flag->action.empty() || (flag->sums & alarms) != 0)) continue;
      // A flag of the second channel has a field of its own, so flags are compared by name.
      auto count = std::ranges::find_if(counts, [&](const RaisedFlag& known) {
        return known.is_alarm == is_alarm && known.flag->name == flag->name;
      });
      if (count == counts.end()) count = counts.insert(counts.end(), {.flag = flag, .is_alarm = is_alarm});
      // Counts a reading once if both channels report the flag.
      const bool is_known = std::exchange(count->last, &reading) == &reading;
      count->channels.insert(flags.field->name);
      if (is_known) continue;
      ++count->readings;
      count->invalid += is_invalid(reading) ? 1 : 0;
    }
  }
}

std::string share(std::size_t some, std::size_t all) {
  return some == all ? fmt::format("all {}", all) : fmt::format("{} of {}", some, all);
}

template <class IsDamage>
void judge_validity(const std::vector<const Reading*>& readings, const IsDamage& is_damage,
                    std::vector<Finding>& findings) {
  std::size_t position = 0;
  std::size_t turns = 0;
  std::size_t usable_bits = 0;
  for (const Reading* reading : readings) {
    if (reading->singleturn_validity() == Validity::invalid) {
      ++position;
      usable_bits = std::max<std::size_t>(usable_bits, reading->singleturn_valid_bits);
    }
    turns += reading->multiturn_validity() == Validity::invalid ? 1 : 0;
  }
  if (std::max(position, turns) == 0 || is_damage(std::max(position, turns))) return;
  const std::string upper = usable_bits != 0 ? fmt::format(", but for its upper {} bits", usable_bits) : "";
  findings.push_back(finding(FindingKind::position_invalid,
                             {fmt::format("{}", std::max(position, turns)), fmt::format("{}", readings.size()),
                              position > 0 ? "position" : "number of turns", position > 0 ? upper : ""}));
}

}  // namespace

void judge_state(const Case& one, std::vector<Finding>& findings) {
  std::vector<const Reading*> readings;
  // readings after the start-up; flags that are raised during the start-up are ignored
  std::vector<const Reading*> ready;
  for (const Attempted& attempt : one.seen.readings) {
    if (!attempt.reading) continue;
    readings.push_back(&*attempt.reading);
    if (attempt.reading->ready) ready.push_back(&*attempt.reading);
  }
  if (readings.empty()) return;
  if (ready.size() < readings.size()) {
    findings.push_back(
        finding(FindingKind::starting, {fmt::format("the encoder said in {} of {} readings that it is still starting{}",
                                                    readings.size() - ready.size(), readings.size(),
                                                    readings.back()->ready ? ", and at the end no more" : "")}));
  }
  std::vector<RaisedFlag> flags;
  for (const Reading* reading : ready) {
    const std::uint32_t alarms = alarms_of_either(one.unit, *reading);
    count_flags(alarms_of(one.unit, *reading), true, *reading, alarms, flags);
    count_flags(status_of(one.unit, *reading), false, *reading, alarms, flags);
  }
  std::stable_sort(flags.begin(), flags.end(), [](const RaisedFlag& before, const RaisedFlag& after) {
    // flags that come with an invalid position or invalid turns are reported first
    return (before.invalid > 0) > (after.invalid > 0);
  });
  // If the readings that report a flag are fewer than a tenth of the failed readings, the flag may be damage that the
  // checksum missed.
  const std::size_t failed = one.seen.readings.size() - one.good;
  const auto is_damage = [failed](std::size_t count) { return count * 10 < failed; };
  std::erase_if(flags, [&](const RaisedFlag& rare) { return is_damage(rare.readings); });
  for (RaisedFlag& flag : flags) flag.invalid = is_damage(flag.invalid) ? 0 : flag.invalid;
  bool is_explained = false;
  for (const RaisedFlag& raised : flags) {
    const std::string_view action =
        raised.flag->action.empty() ? "what the encoder's document says of it" : raised.flag->action;
    const bool in_one =
        raised.channels.size() == 1 && (raised.is_alarm ? one.unit.second_alarms : one.unit.second_status) != nullptr;
    const std::string channel = in_one ? fmt::format(" in {} alone,", *raised.channels.begin()) : "";
    std::string evidence =
        fmt::format("{}{} in {} readings", raised.flag->name, channel, share(raised.readings, ready.size()));
    if (raised.invalid > 0)
      evidence += fmt::format(", whose position is invalid in {}", share(raised.invalid, raised.readings));
    findings.push_back(finding(raised.is_alarm ? FindingKind::alarm : FindingKind::status,
                               {evidence, std::string(raised.flag->meaning), std::string(action)}));
    if (raised.invalid > 0) findings.back().severity = Severity::fault;
    is_explained = is_explained || raised.invalid > 0;
  }
  if (!is_explained) judge_validity(ready, is_damage, findings);
}

namespace {

// Returns the natural logarithm of the binomial coefficient "`all` over `some`".
double log_choose(std::size_t all, std::size_t some) {
  return std::lgamma(static_cast<double>(all + 1)) - std::lgamma(static_cast<double>(some + 1)) -
         std::lgamma(static_cast<double>(all - some + 1));
}

}  // namespace

std::optional<Finding> judge_start(const Case& one) {
  // the encoder is called starting if failures at random times would all come first with at most this probability
  constexpr double chance = 1e-3;
  const std::vector<Attempted>& readings = one.seen.readings;
  const auto first =
      std::ranges::find_if(readings, [](const Attempted& attempt) { return attempt.error == Error::none; });
  const auto failed = static_cast<std::size_t>(first - readings.begin());
  if (failed < 2 || failed + one.good != readings.size()) return {};
  const auto silent = std::count_if(readings.begin(), first, [](const Attempted& attempt) { return !attempt.heard; });
  // An encoder that starts may begin to reply in the middle of a request, so some of the failed readings may have a
  // damaged reply; at least half of them must have no reply.
  if (static_cast<std::size_t>(silent) * 2 < failed) return {};
  // If this computer stood still for as long as the failures lasted, it may itself have delayed the first replies.
  if (first->began - readings.front().began <= one.seen.computer_late) return {};
  if (-log_choose(readings.size(), failed) > std::log(chance)) return {};
  return finding(FindingKind::starting,
                 {fmt::format("no good reply came for the first {}, and then all {} readings were good",
                              to_text(first->began - readings.front().began), one.good)});
}

}  // namespace absenc::client
