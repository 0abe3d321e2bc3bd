// SPDX-License-Identifier: Apache-2.0
// Checks the advice for alarms and errors.
#include <algorithm>
#include <array>
#include <cctype>
#include <set>

#include "tests/kit/kit.hpp"
#include "tests/kit/world.hpp"

namespace absenc::kit {
namespace {

// ---- Commands named in the text of an advice

/// A command line that stands in backquotes in the text of an advice.
struct NamedCommand {
  std::string text;  // the command line, for example "absenc run ... reset"
  // the unit's command that `text` runs; null if `text` suits every unit, or runs no known command
  const Command* command = nullptr;
  bool unknown = false;
};

struct VerbName {
  std::string_view name;
  Verb verb;
};
/// Verbs of the tool, each with the kind of command by which a unit implements it.
constexpr auto verb_names = std::to_array<VerbName>({{"alarms", Verb::read},
                                                     {"read", Verb::read},
                                                     {"info", Verb::info},
                                                     {"temperature", Verb::temperature},
                                                     {"scan", Verb::scan},
                                                     {"zero", Verb::zero},
                                                     {"reset-multiturn", Verb::reset_multiturn},
                                                     {"clear-alarms", Verb::clear_alarms},
                                                     {"memory read", Verb::memory_read},
                                                     {"memory write", Verb::memory_write}});
/// Beginnings of command lines, without "absenc"; the name of a setting or of a command follows them.
constexpr std::string_view get_setting = "config get ... ";
constexpr std::string_view set_setting = "config set ... ";
constexpr std::string_view run_command = "run ... ";
/// Verbs of the tool that suit every unit, so the advice of each unit may name them.
constexpr std::array<std::string_view, 3> for_all_units{"list", "identify", "doctor"};

const Command* find_setter(const Unit& unit, std::string_view name) {
  const auto found = std::find_if(unit.commands.begin(), unit.commands.end(), [name](const Command& one) {
    return one.verb == Verb::config_set && (one.reads_back == name || (one.reads_back.empty() && one.name == name));
  });
  return found == unit.commands.end() ? nullptr : &*found;
}

const Command* find_named(const Unit& unit, std::string_view words) {
  for (const VerbName& one : verb_names) {
    if (one.name == words) return find_command(unit, one.verb);
  }
  const auto behind = [&](std::string_view begin) { return words.substr(begin.size()); };
  if (words.starts_with(set_setting)) return find_setter(unit, behind(set_setting));
  const bool gets = words.starts_with(get_setting);
  if (!gets && !words.starts_with(run_command)) return nullptr;
  // Arguments may follow the command's name in the advice, so only the first word is the name.
  std::string_view name = behind(gets ? get_setting : run_command);
  name = name.substr(0, name.find(' '));
  const Command* const found = find_command(unit, name);
  return found != nullptr && gets != (found->verb == Verb::config_get) ? nullptr : found;
}

std::vector<NamedCommand> commands_in(const Unit& unit, std::string_view text) {
  constexpr std::string_view tool = "absenc ";
  std::vector<NamedCommand> all;
  for (std::size_t begin = text.find('`'); begin != std::string_view::npos; begin = text.find('`', begin)) {
    const std::size_t end = text.find('`', begin + 1);
    NamedCommand one{.text = std::string(text.substr(begin + 1, end - begin - 1))};
    const std::string_view words = std::string_view(one.text).substr(std::min(tool.size(), one.text.size()));
    one.command = find_named(unit, words);
    const bool for_all = std::find(for_all_units.begin(), for_all_units.end(), words) != for_all_units.end();
    one.unknown = !one.text.starts_with(tool) || (one.command == nullptr && !for_all);
    all.push_back(one);
    begin = end == std::string_view::npos ? end : end + 1;
  }
  return all;
}

// Returns the text of an advice without its parts in backquotes.
std::string unquoted(std::string_view text) {
  std::string rest;
  bool quoted = false;
  for (const char c : text) {
    if (c == '`') quoted = !quoted;
    if (!quoted && c != '`') rest += c;
  }
  return rest;
}

// ---- Rules for the wording of every advice

/// Phrases that no advice may contain: as the advice for an alarm, they would refer to themselves.
constexpr auto circular_phrases =
    std::to_array<std::string_view>({"read the alarms", "look at the alarms", "the other alarms", "see the alarms"});

/// Checks the wording of one advice. `what` names the alarm or error to which it belongs, for the texts of findings.
void check_words(const Unit& unit, const std::string& what, std::string_view advice, Findings& findings) {
  const auto require = [&](bool holds, std::string_view text) {
    findings.require(holds, [&] { return what + " is advised \"" + std::string(advice) + "\": " + std::string(text); });
  };
  for (const NamedCommand& one : commands_in(unit, advice)) {
    require(!one.unknown, "`" + one.text + "` is not a command of this unit, or not written \"absenc ...\"");
  }
  const std::string rest = unquoted(advice);
  for (const Command& command : unit.commands) {
    // a name of one word, such as "zero", may be ordinary text and needs no backquotes
    const bool is_word = command.name.find('-') == std::string_view::npos;
    require(is_word || rest.find(command.name) == std::string::npos, "it names a command without backquotes");
  }
  for (const std::string_view words : circular_phrases)
    require(rest.find(words) == std::string::npos, "it is circular");
}

/// Splits a message into lower-case clauses at ": " and "; ".
std::vector<std::string> clauses_of(std::string_view text) {
  std::vector<std::string> clauses(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool ends = (text[i] == ';' || text[i] == ':') && i + 1 < text.size() && text[i + 1] == ' ';
    if (!ends) {
      clauses.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(text[i])));
      continue;
    }
    clauses.emplace_back();
    ++i;
  }
  return clauses;
}

// ---- Advice for alarms and status flags

template <class Item>
class AlarmedEncoder {
 public:
  AlarmedEncoder(const Unit& unit, const Configuration& configuration, std::uint32_t alarms)
      : unit_(unit), alarms_(alarms), world_(unit, configuration.options, 1) {
    if (world_.made()) world_.device().raise_alarms(alarms);
  }
  [[nodiscard]] bool made() const { return world_.made(); }
  [[nodiscard]] World<Item>& world() { return world_; }
  [[nodiscard]] ConversationResult read() {
    const Command& command = *find_command(unit_, Verb::read);
    return world_.run(command, least_arguments(command));
  }
  /// Returns whether a reading shows every alarm that this test has raised in the encoder.
  [[nodiscard]] bool shows_alarms() {
    const ConversationResult now = read();
    return now.seen.reading && (now.seen.reading->alarms & alarms_) == alarms_;
  }

 private:
  const Unit& unit_;
  std::uint32_t alarms_;
  World<Item> world_;
};

// Returns whether the result of a command has a field that `reading` lacks.
bool reports_more(const ReportedFields& result, const ReportedFields& reading) {
  return std::any_of(result.fields.begin(), result.fields.end(),
                     [&](const auto& field) { return !reading.fields.contains(field.first); });
}

/// Runs the commands that the advice of alarm `bit` names. Returns whether the alarm has ended.
template <class Item>
bool follow_advice(const Unit& unit, const Configuration& configuration, std::size_t bit, Findings& findings) {
  const FlagInfo& flag = unit.alarms->flags[bit];
  const std::vector<NamedCommand> named = commands_in(unit, flag.action);
  AlarmedEncoder<Item> alarmed(unit, configuration, std::uint32_t{1} << bit);
  if (!alarmed.made() || !alarmed.shows_alarms()) return false;
  const ReportedFields before = alarmed.read().seen;
  bool explained = false;
  bool reported_more = false;
  for (const NamedCommand& one : named) {
    if (one.command == nullptr) continue;
    const ConversationResult ended = alarmed.world().run(*one.command, least_arguments(*one.command));
    explained = explained || (!ended.good() && !ended.detail.empty());
    reported_more =
        reported_more || (ended.good() && !one.command->changes_encoder && reports_more(ended.seen, before));
  }
  alarmed.world().pass(std::chrono::seconds(1));  // gives the encoder time to write its memory
  const bool gone = !alarmed.shows_alarms();
  findings.require(named.empty() || gone || explained || reported_more, [&] {
    return configuration.text + ", alarm " + std::string(flag.name) + ": following \"" + std::string(flag.action) +
           "\" has no effect and no explanation";
  });
  return gone;
}

template <class Item>
void check_alarms(const Unit& unit, Findings& findings) {
  for (std::size_t bit = 0; unit.alarms != nullptr && bit < unit.alarms->flags.size(); ++bit) {
    const FlagInfo& flag = unit.alarms->flags[bit];
    if (flag.name.empty()) continue;
    const std::vector<NamedCommand> named = commands_in(unit, flag.action);
    const std::string what = "alarm " + std::string(flag.name);
    findings.require(flag.action != read_the_alarms,
                     [&] { return what + " refers to the alarms, of which it is one"; });
    bool goes_once = false;
    for (const Configuration& configuration : configurations(unit)) {
      if (configuration.is_model) goes_once = follow_advice<Item>(unit, configuration, bit, findings) || goes_once;
    }
    const bool should_go = std::any_of(named.begin(), named.end(), [](const NamedCommand& one) {
      return one.command != nullptr && one.command->changes_encoder;
    });
    findings.require(goes_once || !should_go, [&] { return what + " does not end when its advice is followed"; });
  }
}

/// Checks that a reading reports at least one raised alarm if it has a status flag whose advice is to read the alarms.
template <class Item>
void check_status(const Unit& unit, const Configuration& configuration, Findings& findings) {
  if (unit.alarms == nullptr || unit.status == nullptr) return;
  for (std::size_t alarm = 0; alarm < unit.alarms->flags.size(); ++alarm) {
    if (unit.alarms->flags[alarm].name.empty()) continue;
    AlarmedEncoder<Item> alarmed(unit, configuration, std::uint32_t{1} << alarm);
    if (!alarmed.made()) return;
    const std::optional<Reading> reading = alarmed.read().seen.reading;
    for (std::size_t bit = 0; reading && bit < unit.status->flags.size(); ++bit) {
      const FlagInfo& flag = unit.status->flags[bit];
      if ((reading->status >> bit & 1) == 0 || flag.action != read_the_alarms) continue;
      findings.require(reading->alarms != 0, [&] {
        return configuration.text + ", status " + std::string(flag.name) + " refers to the alarms, but none is raised";
      });
    }
  }
}

// ---- Advice for errors

void check_message(const Unit& unit, const std::string& what, const Command& command, const ConversationResult& ended,
                   Findings& findings) {
  const ErrorText& text = text_of(ended.error);
  const bool callers_fault = ended.error <= Error::buffer_too_small;
  const std::string advice = ended.advice.empty() && !callers_fault ? std::string(text.advice) : ended.advice;
  check_words(unit, what, advice, findings);
  const std::vector<NamedCommand> named = commands_in(unit, advice);
  findings.require(named.empty() || named[0].command != &command || !advice.starts_with('`'),
                   [&] { return what + ": the advice only repeats the command"; });
  findings.require(!command.changes_encoder || advice.find("read again") == std::string::npos,
                   [&] { return what + ": \"read again\" is no advice for a command that changes the encoder"; });
  std::set<std::string> seen_clauses;
  for (const std::string_view part :
       {std::string_view(text.description), std::string_view(ended.detail), std::string_view(advice)}) {
    for (const std::string& clause : clauses_of(part)) {
      findings.require(clause.size() < 12 || seen_clauses.insert(clause).second,
                       [&] { return what + " repeats \"" + clause + "\""; });
    }
  }
}

/// Calls `use(name, spoil)` without a problem, then for each problem of an encoder. `spoil(world)` causes the
/// problem.
template <class Item, class Use>
void for_each_problem(const Unit& unit, Use use) {
  use(std::string("nothing"), [](World<Item>&) {});
  use(std::string("all alarms"), [](World<Item>& world) { world.device().raise_alarms(~std::uint32_t{0}); });
  for (std::size_t i = 0; i < unit.conditions.size(); ++i) {
    const Condition& one = unit.conditions[i];
    for (const std::int64_t value : {one.minimum, one.maximum}) {
      use(std::string(one.name) + "=" + std::to_string(value),
          [i, value](World<Item>& world) { world.device().set_condition(i, value, world.line().now()); });
    }
  }
  for (std::size_t kind = 0; kind < sim::fault_names.size(); ++kind) {
    use(std::string(sim::fault_names[kind]), [kind](World<Item>& world) {
      sim::FaultRates rates;
      rates.rates[kind] = 1;
      world.set_rates(rates);
    });
  }
}

// Time limit of one conversation, in simulated time: a host that polls often is slow to simulate.
constexpr Time time_limit = std::chrono::milliseconds(100);

template <class Item>
void check_errors(const Unit& unit, const Configuration& configuration, Findings& findings) {
  for_each_problem<Item>(unit, [&](const std::string& problem, const auto& spoil) {
    for (const Command& command : unit.commands) {
      World<Item> world(unit, configuration.options, 1);
      if (!world.made()) return;
      spoil(world);
      const ConversationResult ended = world.run(command, least_arguments(command), time_limit);
      if (!ended.made || !ended.ended || ended.error == Error::none) continue;
      check_message(unit, configuration.text + ", " + problem + ", " + std::string(command.name), command, ended,
                    findings);
    }
  });
}

// Checks the advice that `Unit::explain` gives for those test vectors of the unit whose reply is bad.
void check_explanations(const Unit& unit, Findings& findings) {
  if (unit.explain == nullptr) return;
  for (const Vector& vector : unit.vectors) {
    const std::optional<Options> options = options_of(unit, vector.options);
    if (vector.error == Error::none || !options) continue;
    const OwnedFrame request = frame_of(unit, vector.request);
    const OwnedFrame reply = frame_of(unit, vector.reply);
    const Explanation seen_clauses = unit.explain(*options, vector.error, request.frame(), reply.frame());
    check_words(unit, std::string(vector.id), seen_clauses.advice, findings);
  }
}

template <class Item>
void check_all(const Unit& unit, Findings& findings) {
  check_alarms<Item>(unit, findings);
  const std::vector<Configuration> setups = configurations(unit);
  for (const Configuration& configuration : setups) {
    if (configuration.is_model) check_status<Item>(unit, configuration, findings);
  }
  check_errors<Item>(unit, setups.front(), findings);
}

}  // namespace

Findings check_advice(const Unit& unit) {
  Findings findings;
  for (const FieldInfo& field : unit.fields) {
    for (const FlagInfo& flag : field.flags) {
      check_words(unit, std::string(field.name) + " " + std::string(flag.name), flag.action, findings);
    }
  }
  for (const ErrorText& text : error_texts) check_words(unit, std::string(text.name), text.advice, findings);
  check_explanations(unit, findings);
  if (unit.link == LinkKind::can) {
    check_all<CanFrame>(unit, findings);
  } else {
    check_all<std::uint8_t>(unit, findings);
  }
  return findings;
}

}  // namespace absenc::kit
