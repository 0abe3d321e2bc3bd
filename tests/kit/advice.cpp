// SPDX-License-Identifier: Apache-2.0
// Checks that a user can follow each advice, and that doing so has an effect.
#include <algorithm>
#include <array>
#include <cctype>
#include <set>

#include "tests/kit/kit.hpp"
#include "tests/kit/world.hpp"

namespace absenc::kit {
namespace {

// ---- Commands named in a text

/// A command line quoted in a text.
struct Named {
  std::string text;                  // for example "absenc run ... reset"
  const Command* command = nullptr;  // the unit's command; null if valid for every unit or `unknown`
  bool unknown = false;
};

struct VerbName {
  std::string_view name;
  Verb verb;
};
/// Verbs of the tool that a unit implements with exactly one command.
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
/// Beginnings of command lines that continue with the name of a setting or of a command.
constexpr std::string_view get_setting = "config get ... ";
constexpr std::string_view set_setting = "config set ... ";
constexpr std::string_view run_command = "run ... ";
/// Verbs of the tool that every unit supports.
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
  // Arguments may follow the name.
  std::string_view name = behind(gets ? get_setting : run_command);
  name = name.substr(0, name.find(' '));
  const Command* const found = find_command(unit, name);
  return found != nullptr && gets != (found->verb == Verb::config_get) ? nullptr : found;
}

std::vector<Named> commands_in(const Unit& unit, std::string_view text) {
  constexpr std::string_view tool = "absenc ";
  std::vector<Named> all;
  for (std::size_t begin = text.find('`'); begin != std::string_view::npos; begin = text.find('`', begin)) {
    const std::size_t end = text.find('`', begin + 1);
    Named one{.text = std::string(text.substr(begin + 1, end - begin - 1))};
    const std::string_view words = std::string_view(one.text).substr(std::min(tool.size(), one.text.size()));
    one.command = find_named(unit, words);
    const bool for_all = std::find(for_all_units.begin(), for_all_units.end(), words) != for_all_units.end();
    one.unknown = !one.text.starts_with(tool) || (one.command == nullptr && !for_all);
    all.push_back(one);
    begin = end == std::string_view::npos ? end : end + 1;
  }
  return all;
}

// Returns the text without its parts in backquotes.
std::string unquoted(std::string_view text) {
  std::string rest;
  bool quoted = false;
  for (const char c : text) {
    if (c == '`') quoted = !quoted;
    if (!quoted && c != '`') rest += c;
  }
  return rest;
}

// ---- Rules for every advice

/// Phrases that send the reader back to the alarms which the advice explains.
constexpr auto circular =
    std::to_array<std::string_view>({"read the alarms", "look at the alarms", "the other alarms", "see the alarms"});

/// Checks one advice. `what` names the alarm or error that it belongs to.
void check_words(const Unit& unit, const std::string& what, std::string_view advice, Findings& findings) {
  const auto require = [&](bool holds, std::string_view text) {
    findings.require(holds, [&] { return what + " is advised \"" + std::string(advice) + "\": " + std::string(text); });
  };
  for (const Named& one : commands_in(unit, advice)) {
    require(!one.unknown, "`" + one.text + "` is no command of this unit, or not written \"absenc ...\"");
  }
  const std::string rest = unquoted(advice);
  for (const Command& command : unit.commands) {
    // a one-word name such as "zero" may be ordinary text
    const bool is_word = command.name.find('-') == std::string_view::npos;
    require(is_word || rest.find(command.name) == std::string::npos, "a command that it names is not in backquotes");
  }
  for (const std::string_view words : circular) require(rest.find(words) == std::string::npos, "that is circular");
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

// ---- Alarms and status

template <class Item>
class Sick {
 public:
  Sick(const Unit& unit, const Configuration& way, std::uint32_t alarms)
      : unit_(unit), alarms_(alarms), world_(unit, way.options, 1) {
    if (world_.made()) world_.device().raise_alarms(alarms);
  }
  [[nodiscard]] bool made() const { return world_.made(); }
  [[nodiscard]] World<Item>& world() { return world_; }
  [[nodiscard]] Ended read() {
    const Command& command = *find_command(unit_, Verb::read);
    return world_.run(command, least_arguments(command));
  }
  /// Returns whether the reading shows every alarm that this encoder has raised.
  [[nodiscard]] bool is_ill() {
    const Ended now = read();
    return now.seen.reading && (now.seen.reading->alarms & alarms_) == alarms_;
  }

 private:
  const Unit& unit_;
  std::uint32_t alarms_;
  World<Item> world_;
};

// Returns whether the command's result has a field that the reading lacks.
bool tells_more(const Seen& told, const Seen& reading) {
  return std::any_of(told.fields.begin(), told.fields.end(),
                     [&](const auto& field) { return !reading.fields.contains(field.first); });
}

/// Runs the commands that this alarm's advice names, in order. Returns whether the alarm has ended.
template <class Item>
bool follow_advice(const Unit& unit, const Configuration& way, std::size_t bit, Findings& findings) {
  const FlagInfo& flag = unit.alarms->flags[bit];
  const std::vector<Named> named = commands_in(unit, flag.action);
  Sick<Item> sick(unit, way, std::uint32_t{1} << bit);
  if (!sick.made() || !sick.is_ill()) return false;
  const Seen before = sick.read().seen;
  bool explained = false;
  bool told_more = false;
  for (const Named& one : named) {
    if (one.command == nullptr) continue;
    const Ended ended = sick.world().run(*one.command, least_arguments(*one.command));
    explained = explained || (!ended.good() && !ended.detail.empty());
    told_more = told_more || (ended.good() && !one.command->changes_encoder && tells_more(ended.seen, before));
  }
  sick.world().pass(std::chrono::seconds(1));  // the encoder may be writing its memory
  const bool gone = !sick.is_ill();
  findings.require(named.empty() || gone || explained || told_more, [&] {
    return way.text + ", alarm " + std::string(flag.name) + ": whoever does \"" + std::string(flag.action) +
           "\" changes nothing, and is not told why";
  });
  return gone;
}

template <class Item>
void check_alarms(const Unit& unit, Findings& findings) {
  for (std::size_t bit = 0; unit.alarms != nullptr && bit < unit.alarms->flags.size(); ++bit) {
    const FlagInfo& flag = unit.alarms->flags[bit];
    if (flag.name.empty()) continue;
    const std::vector<Named> named = commands_in(unit, flag.action);
    const std::string what = "alarm " + std::string(flag.name);
    findings.require(flag.action != read_the_alarms, [&] { return what + " sends to the alarms, among which it is"; });
    bool goes_once = false;
    for (const Configuration& way : configurations(unit)) {
      if (way.is_model) goes_once = follow_advice<Item>(unit, way, bit, findings) || goes_once;
    }
    const bool should_go = std::any_of(named.begin(), named.end(), [](const Named& one) {
      return one.command != nullptr && one.command->changes_encoder;
    });
    findings.require(goes_once || !should_go, [&] { return what + " stays whatever is done of its advice"; });
  }
}

/// Checks that a reading whose status flag refers to the alarms reports an alarm.
template <class Item>
void check_status(const Unit& unit, const Configuration& way, Findings& findings) {
  if (unit.alarms == nullptr || unit.status == nullptr) return;
  for (std::size_t alarm = 0; alarm < unit.alarms->flags.size(); ++alarm) {
    if (unit.alarms->flags[alarm].name.empty()) continue;
    Sick<Item> sick(unit, way, std::uint32_t{1} << alarm);
    if (!sick.made()) return;
    const std::optional<Reading> reading = sick.read().seen.reading;
    for (std::size_t bit = 0; reading && bit < unit.status->flags.size(); ++bit) {
      const FlagInfo& flag = unit.status->flags[bit];
      if ((reading->status >> bit & 1) == 0 || flag.action != read_the_alarms) continue;
      findings.require(reading->alarms != 0, [&] {
        return way.text + ", status " + std::string(flag.name) + " sends to the alarms, and there is none";
      });
    }
  }
}

// ---- Errors

void check_message(const Unit& unit, const std::string& what, const Command& command, const Ended& ended,
                   Findings& findings) {
  const ErrorText& text = text_of(ended.error);
  const bool callers_fault = ended.error <= Error::buffer_too_small;
  const std::string advice = ended.advice.empty() && !callers_fault ? std::string(text.advice) : ended.advice;
  check_words(unit, what, advice, findings);
  const std::vector<Named> named = commands_in(unit, advice);
  findings.require(named.empty() || named[0].command != &command || !advice.starts_with('`'),
                   [&] { return what + ": the advice is only to do the same again"; });
  findings.require(!command.changes_encoder || advice.find("read again") == std::string::npos,
                   [&] { return what + ": \"read again\" is no advice of a command that changes the encoder"; });
  std::set<std::string> said;
  for (const std::string_view part :
       {std::string_view(text.description), std::string_view(ended.detail), std::string_view(advice)}) {
    for (const std::string& clause : clauses_of(part)) {
      findings.require(clause.size() < 12 || said.insert(clause).second,
                       [&] { return what + " says twice \"" + clause + "\""; });
    }
  }
}

/// Calls `use(name, spoil)` for each problem that an encoder can have: alarms, conditions and line faults.
template <class Item, class Use>
void each_trouble(const Unit& unit, Use use) {
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

// Time limit of one conversation. A host that polls ten thousand times a second is slow to simulate, and a failure
// shows early.
constexpr Time patience = std::chrono::milliseconds(100);

template <class Item>
void check_errors(const Unit& unit, const Configuration& way, Findings& findings) {
  each_trouble<Item>(unit, [&](const std::string& trouble, const auto& spoil) {
    for (const Command& command : unit.commands) {
      World<Item> world(unit, way.options, 1);
      if (!world.made()) return;
      spoil(world);
      const Ended ended = world.run(command, least_arguments(command), patience);
      if (!ended.made || !ended.ended || ended.error == Error::none) continue;
      check_message(unit, way.text + ", " + trouble + ", " + std::string(command.name), command, ended, findings);
    }
  });
}

// Checks the advice that the unit's documents give for bad replies.
void check_explanations(const Unit& unit, Findings& findings) {
  if (unit.explain == nullptr) return;
  for (const Vector& vector : unit.vectors) {
    const std::optional<Options> options = options_of(unit, vector.options);
    if (vector.error == Error::none || !options) continue;
    const Held request = held(unit, vector.request);
    const Held reply = held(unit, vector.reply);
    const Explanation said = unit.explain(*options, vector.error, request.frame(), reply.frame());
    check_words(unit, std::string(vector.id), said.advice, findings);
  }
}

template <class Item>
void check_all(const Unit& unit, Findings& findings) {
  check_alarms<Item>(unit, findings);
  const std::vector<Configuration> ways = configurations(unit);
  for (const Configuration& way : ways) {
    if (way.is_model) check_status<Item>(unit, way, findings);
  }
  check_errors<Item>(unit, ways.front(), findings);
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
