// SPDX-License-Identifier: Apache-2.0
// Parses the command line by the tables of the verbs and runs the verb.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/port/address.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/mqtt_process.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/help.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/verbs/run.hpp"

namespace absenc::tool {

namespace {

bool asks_for_help(std::string_view word) { return word == "--help" || word == "-h"; }

/// A parser of the words after a verb; it reports a wrong name before a missing parameter.
class ArgumentParser {
 public:
  explicit ArgumentParser(const Subcommand& subcommand) : subcommand_(&subcommand) {
    for (const Parameter& parameter : subcommand.parameters) {
      if (!parameter.is_option()) arguments_.push_back(&parameter);
    }
  }

  /// Returns the parsed parameters; nothing if help was requested. Throws UsageError.
  [[nodiscard]] std::optional<Invocation> parse(std::span<char* const> words) {
    while (!words.empty()) {
      const std::string_view word = words.front();
      words = words.subspan(1);
      if (asks_for_help(word)) return std::nullopt;
      if (word == "--") break;
      if (is_name(word)) {
        take_option(word, words);
      } else {
        take_argument(word);
      }
    }
    for (const std::string_view word : words) take_argument(word);  // after "--" every word is an argument
    refuse_numbers();
    return std::move(invocation_);
  }

 private:
  // A word like "-5" is a negative number, not an option.
  static bool is_name(std::string_view word) {
    return word.size() > 1 && word[0] == '-' && word[1] != '.' && (word[1] < '0' || word[1] > '9');
  }

  void take_option(std::string_view word, std::span<char* const>& words) {
    const std::size_t equals = word.find('=');
    const std::string_view name = word.substr(0, equals);
    const Parameter* parameter = find_parameter(name);
    if (parameter == nullptr) refuse_option(name);
    const bool has_value = equals != std::string_view::npos;
    const bool is_flag = parameter->value.empty();
    if (has_value && is_flag) valued_flag_ = name;
    if (has_value || is_flag) {
      return invocation_.add(parameter->name, std::string(has_value ? word.substr(equals + 1) : ""));
    }
    if (words.empty() || is_name(words.front())) throw UsageError(fmt::format("{} needs a value", name));
    invocation_.add(parameter->name, words.front());
    words = words.subspan(1);
  }

  void take_argument(std::string_view word) {
    if (taken_ == arguments_.size()) {
      if (!extra_) extra_ = word;
      return;
    }
    const Parameter& parameter = *arguments_[taken_];
    if (parameter.name == parameter::protocol.name) {
      take_protocol(word);
    } else {
      invocation_.add(parameter.name, std::string(word));
    }
    if (!parameter.repeatable) ++taken_;
  }

  // Splits a word like "tformat?model=23-bit&motion=rpm=60", which may begin with "sim:", into protocol and settings.
  void take_protocol(std::string_view word) {
    constexpr std::string_view sim = "sim:";
    if (word.starts_with(sim)) word.remove_prefix(sim.size());
    const std::size_t question = std::min(word.find('?'), word.size());
    invocation_.add(parameter::protocol.name, std::string(word.substr(0, question)));
    for (std::string_view rest = word.substr(std::min(question + 1, word.size())); !rest.empty();) {
      const std::size_t end = std::min(rest.find('&'), rest.size());
      take_setting(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }

  void take_setting(std::string_view setting) {
    const std::size_t equals = std::min(setting.find('='), setting.size());
    const std::string_view name = setting.substr(0, equals);
    const client::LinkParameter* known = client::find_link_parameter(name);
    const bool of_virtual_encoder = known != nullptr && known->port_kinds == "sim";
    if (of_virtual_encoder || name == "model") {
      if (const Parameter* own = find_parameter(fmt::format("--{}", name))) {
        return invocation_.add(own->name, std::string(setting.substr(std::min(equals + 1, setting.size()))));
      }
    }
    const Parameter* option = find_parameter(parameter::option.name);
    if (option == nullptr) {
      throw UsageError(
          fmt::format("{} takes no settings: give the protocol without \"{}\"", subcommand_->name, setting));
    }
    invocation_.add(option->name, std::string(setting));
  }

  [[nodiscard]] const Parameter* find_parameter(std::string_view name) const {
    const auto& all = subcommand_->parameters;
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
    return found == all.end() ? nullptr : &*found;
  }

  [[noreturn]] void refuse_option(std::string_view name) const {
    std::vector<std::string_view> names{"--help"};
    for (const Parameter& parameter : subcommand_->parameters) {
      if (parameter.is_option()) names.push_back(parameter.name);
    }
    throw UsageError(fmt::format("{} has no option {}{}", subcommand_->name, name, suggestion(name, names)));
  }

  // Throws UsageError if there are too few or too many parameters or values.
  void refuse_numbers() const {
    if (extra_) {
      throw UsageError(fmt::format("\"{}\" is too much: usage is {}", *extra_, usage(*subcommand_)));
    }
    for (const Parameter& parameter : subcommand_->parameters) {
      const std::size_t count = invocation_.texts(parameter.name).size();
      if (parameter.required && count == 0) throw UsageError(missing(parameter));
      if (!parameter.repeatable && count > 1) {
        throw UsageError(fmt::format("{} is given {} times: which is meant?", parameter.name, count));
      }
    }
    if (valued_flag_) throw UsageError(fmt::format("{} takes no value", *valued_flag_));
  }

  [[nodiscard]] std::string missing(const Parameter& parameter) const {
    const std::string what = parameter.is_option() ? std::string(parameter.name) : fmt::format("<{}>", parameter.name);
    return fmt::format("{} is missing ({}): usage is {}", what, parameter.meaning, usage(*subcommand_));
  }

  const Subcommand* subcommand_;
  std::vector<const Parameter*> arguments_;
  std::size_t taken_ = 0;
  std::optional<std::string_view> extra_, valued_flag_;
  Invocation invocation_;
};

// Throws UsageError, because no verb begins with `group` (which may be "") and continues with `words`.
[[noreturn]] void refuse_verb(std::string_view group, std::span<char*> words) {
  const std::vector<std::string_view> verbs = words_after(group);
  if (words.empty()) {
    throw UsageError(fmt::format("what shall be done{}? Usage: absenc {}{}<verb> ..., where the verb is one of {}",
                                 group.empty() ? "" : fmt::format(" with the {}", group), group,
                                 group.empty() ? "" : " ", fmt::join(verbs, ", ")));
  }
  const std::string_view word = words.front();
  const std::string of_group = group.empty() ? "" : fmt::format(" of {}", group);
  if (!word.starts_with('-')) {
    throw UsageError(fmt::format("there is no verb \"{}\"{}{}", word, of_group, suggestion(word, verbs)));
  }
  const std::string_view name = word.substr(0, word.find('='));
  const std::string verb = group.empty() ? "<verb>" : fmt::format("{} <verb>", group);
  for (const Subcommand* subcommand : all_subcommands()) {
    for (const Parameter& parameter : subcommand->parameters) {
      if (parameter.name != name) continue;
      throw UsageError(fmt::format("{0} stands before the verb: write absenc {1} ... {0}", name, verb));
    }
  }
  const std::array<std::string_view, 2> options{"--help", "--version"};
  throw UsageError(fmt::format("there is no option {}{}{}", name, of_group,
                               suggestion(name, std::span(options).first(group.empty() ? 2 : 1))));
}

// Throws UsageError if a word follows --help or --version in place of a verb.
void require_last(std::span<char*> words) {
  if (words.size() == 1) return;
  throw UsageError(fmt::format("\"{}\" is too much behind {}", words[1], words[0]));
}

/// Returns the verb that `words` begin with, or null if no verb is to be run. An unknown word is never skipped.
const Subcommand* find_verb(std::span<char*>& words, std::string& understood) {
  for (;;) {
    if (words.empty()) refuse_verb(understood, words);
    const std::string_view word = words.front();
    if (asks_for_help(word)) {
      require_last(words);
      print_line(understood.empty() ? help() : help(understood));
      return nullptr;
    }
    if (understood.empty() && word == "--version") {
      require_last(words);
      print_line("absenc " ABSENC_VERSION);
      return nullptr;
    }
    bool is_group = false;
    for (const Subcommand* subcommand : all_subcommands()) {
      const std::string_view group = first_word(*subcommand);
      if (group == understood && last_word(*subcommand) == word) {
        understood = subcommand->name;
        return subcommand;
      }
      is_group = is_group || (understood.empty() && !group.empty() && group == word);
    }
    if (!is_group) refuse_verb(understood, words);
    understood = word;
    words = words.subspan(1);
  }
}

std::string_view name_of(os::Failure::Kind kind) {
  static constexpr std::array<std::string_view, 7> names{"not_found", "no_permission", "in_use", "unsupported",
                                                         "bad_rate",  "lost",          "system"};
  return names[static_cast<std::size_t>(kind)];
}

Json failure(std::string_view name, const std::exception& failed) {
  Json json = Json::object().set("ok", false).set("error", name).set("message", failed.what());
  if (const Change* change = change_of(failed)) set_change(json, *change);
  return json;
}

// Runs the verb and returns its exit status. With --json, prints a Failure or os::Failure as JSON.
int run(const Subcommand& subcommand, const Invocation& invocation) {
  const bool json = invocation.has("--json");
  try {
    return subcommand.run(invocation);
  } catch (const EncoderFailure& failed) {
    if (!json) throw;
    print_line(to_json(failed.trouble).line());
  } catch (const os::Failure& failed) {
    if (!json) throw;
    print_line(failure(name_of(failed.kind()), failed).line());
  } catch (const Failure& failed) {
    if (!json) throw;
    print_line(failure("failed", failed).line());
  }
  return exit_failed;
}

// Called if absenc is run without any word: the user has probably just connected an adapter, so the ports are listed.
int welcome() {
  const int status = ports_subcommand.run({});
  print_line("\n`absenc --help` shows all that absenc does, `absenc list` all encoders.");
  return status;
}

/// Runs the command line `words` and returns the exit status. `understood` receives the part of the verb that was
/// recognised.
int run_command_line(std::span<char*> words, std::string& understood) {
  if (words.empty()) return welcome();
  const Subcommand* subcommand = find_verb(words, understood);
  if (subcommand == nullptr) return exit_good;
  const std::optional<Invocation> invocation = ArgumentParser(*subcommand).parse(words.subspan(1));
  if (invocation) return run(*subcommand, *invocation);
  print_line(help(*subcommand));
  return exit_good;
}

}  // namespace

}  // namespace absenc::tool

int main(int argument_count, char** arguments) {
  using namespace absenc::tool;
  std::string understood;
  std::vector<char*> words(arguments, arguments + argument_count);
  words.erase(words.begin(), words.begin() + std::min(argument_count, 1));  // POSIX allows that argc is 0
  if (words.size() == 1 && words.front() == absenc::serve::mqtt_process_verb) return absenc::serve::run_mqtt_process();
  std::string help_option = "--help", version_option = "--version";
  // `absenc help read` prints the same as `absenc read --help`.
  if (!words.empty() && std::string_view(words.front()) == "help") {
    words.erase(words.begin());
    words.push_back(help_option.data());
  } else if (!words.empty() && std::string_view(words.front()) == "version") {
    words.front() = version_option.data();
  }
  try {
    absenc::os::protect_standard_streams();
    return run_command_line(words, understood);
  } catch (const UsageError& error) {
    print_message(error.what());
    print_note(fmt::format("Try: absenc {}{}--help", understood, understood.empty() ? "" : " "));
    return exit_usage;
  } catch (const OutputClosed&) {
    return exit_good;
  } catch (const absenc::os::Interrupted&) {
    print_message("interrupted");
    return exit_failed;
  } catch (const std::exception& error) {
    print_message(error.what());
    return exit_failed;
  }
}
