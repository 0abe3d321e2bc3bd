// SPDX-License-Identifier: Apache-2.0
// Checks how readings report the three states of an alarm: clear, raised, not reported.
#include <algorithm>

#include "tests/kit/kit.hpp"
#include "tests/kit/world.hpp"

namespace absenc::kit {
namespace {

/// Flags of one channel of a reading: `bits` has the bits of the flags that are set, `reported` those of all flags that
/// the reply contains.
struct Flags {
  const FieldInfo* field;
  std::uint32_t bits;
  std::uint32_t reported;
};

/// Returns a mask of the flags of `field` that have a name.
std::uint32_t named(const FieldInfo& field) {
  std::uint32_t mask = 0;
  for (std::size_t i = 0; i < field.flags.size(); ++i) {
    if (!field.flags[i].name.empty()) mask |= std::uint32_t{1} << i;
  }
  return mask;
}

std::vector<Flags> channels_of(const FieldInfo* first, const FieldInfo* second, std::uint32_t bits,
                               std::uint32_t reported) {
  std::vector<Flags> flags;
  if (first != nullptr) flags.push_back({first, bits, reported});
  if (second != nullptr) flags.push_back({second, bits >> first->flags.size(), reported >> first->flags.size()});
  return flags;
}

std::vector<Flags> alarms_of(const Unit& unit, const Reading& reading) {
  return channels_of(unit.alarms, unit.second_alarms, reading.alarms, reading.alarms_reported);
}
std::vector<Flags> status_of(const Unit& unit, const Reading& reading) {
  return channels_of(unit.status, unit.second_status, reading.status, reading.status_reported);
}

/// The reading of a command that is run on a line, and the fields of its last reply, decoded as from a capture.
struct LiveAndCaptured {
  std::optional<Reading> live;
  ReportedFields captured;
};

/// A virtual encoder with at most one raised alarm.
template <class Item>
class EncoderWithAlarm {
 public:
  EncoderWithAlarm(const Unit& unit, const Options& options, std::uint32_t alarm)
      : unit_(unit), world_(unit, options, 1) {
    if (made()) world_.device().raise_alarms(alarm);
    if (made()) world_.move(0x4000'0000);
  }
  [[nodiscard]] bool made() const { return world_.made(); }

  [[nodiscard]] LiveAndCaptured execute(const Command& command) {
    LiveAndCaptured outcome;
    const ConversationResult result = world_.run(command, least_arguments(command));
    if (!result.good()) return outcome;
    outcome.live = result.seen.reading;
    if (result.received.empty()) return outcome;
    const std::size_t bits = carries_bits(unit_.link) ? 8 * result.received.size() : 0;
    if (unit_.decode(world_.options(), {.bytes = result.sent}, {.bytes = result.received, .bits = bits},
                     outcome.captured) != Error::none) {
      outcome.captured = {};
    }
    return outcome;
  }

 private:
  const Unit& unit_;
  World<Item> world_;
};

template <class Item>
class States {
 public:
  States(const Unit& unit, const Configuration& configuration, Findings& findings)
      : unit_(unit), configuration_(configuration), findings_(findings) {}

  void check() {
    const Command& whole = *find_command(unit_, Verb::read);
    for (const Command& command : unit_.commands) {
      if (command.changes_encoder || command.verb == Verb::scan) continue;
      EncoderWithAlarm<Item> normal(unit_, configuration_.options, 0);
      if (!normal.made()) return;
      const LiveAndCaptured before = normal.execute(whole);
      const LiveAndCaptured clear = normal.execute(command);
      for (std::size_t bit = 0; bit < unit_.alarms->flags.size(); ++bit) {
        if (unit_.alarms->flags[bit].name.empty()) continue;
        context_ = std::string(command.name) + ", " + std::string(unit_.alarms->flags[bit].name);
        check(before, clear, bit, false);
        EncoderWithAlarm<Item> alarmed(unit_, configuration_.options, 1u << bit);
        const LiveAndCaptured before_raised = alarmed.execute(whole);
        check(before_raised, alarmed.execute(command), bit, true);
      }
    }
  }

 private:
  template <class Text>
  void require(bool holds, Text&& text) {
    findings_.require(holds, [&] { return configuration_.text + ", " + context_ + ": " + std::string(text); });
  }

  void check(const LiveAndCaptured& whole, const LiveAndCaptured& outcome, std::size_t bit, bool is_raised) {
    judge(outcome.live, bit, is_raised);
    judge(outcome.captured.reading, bit, is_raised);
    check_carried_flags(outcome.captured);
    check_part(outcome.live, whole.live);
    check_part(outcome.captured.reading, whole.live);
    check_completed(whole, outcome, bit, is_raised);
  }

  void judge(const std::optional<Reading>& reading, std::size_t bit, bool is_raised) {
    if (!reading) return;
    bool is_reported = false;
    bool is_shown = false;
    for (const Flags& state : alarms_of(unit_, *reading)) {
      require((state.bits & ~state.reported & named(*state.field)) == 0, "an alarm is raised and not reported");
      is_reported = is_reported || (state.reported >> bit & 1) != 0;
      is_shown = is_shown || (state.bits >> bit & 1) != 0;
    }
    for (const Flags& state : status_of(unit_, *reading)) {
      require((state.bits & ~state.reported & named(*state.field)) == 0, "a status is set and not reported");
    }
    if (is_raised) require(is_shown || !is_reported, "it is raised and reported clear");
    if (!is_raised) require(!is_shown, "it is reported raised and is not");
  }

  // Returns the flags of `field` that depend on optional alarms which `reading` does not report.
  [[nodiscard]] std::uint32_t absent(const FieldInfo& field, const Reading& reading) const {
    std::uint32_t alarms = 0;
    for (std::size_t i = 0; i < unit_.alarms->flags.size(); ++i) {
      if (unit_.alarms->flags[i].optional) alarms |= std::uint32_t{1} << i & ~reading.alarms_reported;
    }
    if (&field == unit_.alarms) return alarms;
    std::uint32_t mask = 0;
    for (std::size_t i = 0; i < field.flags.size(); ++i) {
      if ((field.flags[i].sums & alarms) != 0) mask |= 1u << i;
    }
    return mask;
  }

  // Checks that the reading has the same flags as the fields of the reply, except those that `absent` returns.
  void check_carried_flags(const ReportedFields& seen) {
    if (!seen.reading) return;
    const auto agrees = [&](const Flags& state) {
      const auto field = seen.fields.find(std::string(state.field->name));
      if (field == seen.fields.end()) return;
      const std::uint32_t mask = named(*state.field) & ~absent(*state.field, *seen.reading);
      require((~state.reported & mask) == 0, "a reply carries flags that its reading does not report");
      require(((static_cast<std::uint32_t>(field->second.number) ^ state.bits) & mask) == 0,
              "a reply carries other flags than its reading");
    };
    for (const Flags& state : alarms_of(unit_, *seen.reading)) agrees(state);
    for (const Flags& state : status_of(unit_, *seen.reading)) agrees(state);
  }

  void check_part(const std::optional<Reading>& part, const std::optional<Reading>& whole) {
    if (!part || !whole) return;
    const auto is_more = [](Validity one, Validity all) { return one == Validity::valid && all == Validity::invalid; };
    require(!is_more(part->singleturn_validity(), whole->singleturn_validity()),
            "a part reports a valid position, the whole an invalid one");
    require(!is_more(part->multiturn_validity(), whole->multiturn_validity()),
            "a part reports valid turns, the whole invalid ones");
  }

  // Checks the reading of a captured reply to which the unit has added the alarms of an earlier reply.
  void check_completed(const LiveAndCaptured& before, const LiveAndCaptured& now, std::size_t bit, bool is_raised) {
    if (unit_.remembered == nullptr || !before.captured.reading || !now.captured.reading) return;
    const Reading reading = unit_.remembered(*before.captured.reading, *now.captured.reading);
    judge(reading, bit, is_raised);
    const std::uint32_t known = before.captured.reading->alarms_reported;
    require((known & ~reading.alarms_reported) == 0, "the alarms of an earlier reply are lost");
    require(reading.singleturn_known && reading.multiturn_known, "the validity of an earlier reply is lost");
    check_part(reading, before.captured.reading);
  }

  const Unit& unit_;
  const Configuration& configuration_;
  Findings& findings_;
  std::string context_;
};

}  // namespace

Findings check_states(const Unit& unit) {
  Findings findings;
  if (unit.alarms == nullptr) return findings;
  for (const Configuration& configuration : configurations(unit)) {
    if (unit.link == LinkKind::can) {
      States<CanFrame>(unit, configuration, findings).check();
    } else {
      States<std::uint8_t>(unit, configuration, findings).check();
    }
  }
  return findings;
}

}  // namespace absenc::kit
