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

#include "absenc/client/configuration.hpp"  // the command reads absenc.toml
#include "absenc/client/text/nearest.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/process.hpp"
#include "tools/absenc/command_line.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/help.hpp"
#include "tools/absenc/optional_ports.hpp"
#include "tools/absenc/parts.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/verbs/run.hpp"
#include "tools/absenc/version.hpp"

namespace absenc::tool {

namespace {

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
      print_line(version_text());
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
  const std::span<char* const> all = words;
  const Subcommand* subcommand = find_verb(words, understood);
  if (subcommand == nullptr) return exit_good;
  const std::optional<Invocation> invocation = parse_arguments(*subcommand, words.subspan(1));
  if (invocation && !subcommand->program.empty()) return run_program(*subcommand, all);
  if (invocation) return run(*subcommand, *invocation);
  print_line(help(*subcommand));
  return exit_good;
}

}  // namespace

}  // namespace absenc::tool

int main(int argument_count, char** arguments) {
  using namespace absenc::tool;
  std::string understood;
  std::vector<std::string> all = absenc::os::command_words(argument_count, arguments);
  std::vector<char*> words;
  for (std::string& word : all) words.push_back(word.data());
  words.erase(words.begin(), words.begin() + std::min<std::ptrdiff_t>(std::ssize(words), 1));  // POSIX: argc may be 0
  std::string help_option = "--help", version_option = "--version";
  // `absenc help read` prints the same as `absenc read --help`.
  if (!words.empty() && std::string_view(words.front()) == "help") {
    words.erase(words.begin());
    words.push_back(help_option.data());
  } else if (!words.empty() && std::string_view(words.front()) == "version") {
    words.front() = version_option.data();
  }
  return run_guarded([&] { return run_command_line(words, understood); }, understood);
}
