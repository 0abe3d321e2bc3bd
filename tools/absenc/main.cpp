// SPDX-License-Identifier: Apache-2.0
// The command line. The only file that includes CLI11: it is slow to compile.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/help.hpp"
#include "tools/absenc/nearest.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/run.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

namespace {

/// The options and arguments of one subcommand in CLI11. What is missing or too much is found here and not there,
/// so that a wrong name is reported before what is missing because of it.
class Parser {
 public:
  /// `parent` is the command itself or the first word of a verb of two.
  Parser(CLI::App& parent, const Subcommand& subcommand)
      : subcommand_(&subcommand), app_(parent.add_subcommand(std::string(last_word(subcommand)))) {
    app_->allow_extras();
    for (const Parameter& parameter : subcommand.parameters) add(parameter);
  }

  [[nodiscard]] const Subcommand& subcommand() const { return *subcommand_; }
  [[nodiscard]] bool parsed() const { return app_->parsed(); }

  [[nodiscard]] Invocation invocation() const {
    refuse_extras();
    Invocation invocation;
    for (const auto& [parameter, option] : options_) {
      if (parameter->required && option->count() == 0) throw UsageError(missing(*parameter));
      const bool is_flag = parameter->is_option() && parameter->value.empty();
      if (is_flag && option->count() > 0 && option->results().front() != "true") {
        throw UsageError(fmt::format("{} takes no value", parameter->name));
      }
      for (const std::string& value : option->results()) invocation.add(parameter->name, value);
    }
    return invocation;
  }

 private:
  void add(const Parameter& parameter) {
    const std::string name(parameter.name);
    CLI::Option* option = nullptr;
    if (parameter.is_option() && parameter.value.empty()) {
      option = app_->add_flag(name);
    } else {
      option = app_->add_option(name);
      option->type_name("")->allow_extra_args(false);
      if (parameter.repeatable) {
        option->expected(parameter.is_option() ? 1 : -1)->take_all();
      } else {
        option->expected(1)->take_last();
      }
    }
    options_.emplace_back(&parameter, option);
  }

  void refuse_extras() const {
    for (const std::string& extra : app_->remaining()) {
      if (extra.size() < 2 || extra[0] != '-') continue;
      const std::string name = extra.substr(0, extra.find('='));
      std::vector<std::string_view> names{"--help"};
      for (const Parameter& parameter : subcommand_->parameters) {
        if (parameter.is_option()) names.push_back(parameter.name);
      }
      throw UsageError(fmt::format("{} has no option {}{}", subcommand_->name, name, suggestion(name, names)));
    }
    if (!app_->remaining().empty()) {
      throw UsageError(fmt::format("\"{}\" is too much: usage is {}", app_->remaining().front(), usage(*subcommand_)));
    }
  }

  [[nodiscard]] std::string missing(const Parameter& parameter) const {
    const std::string what = parameter.is_option() ? std::string(parameter.name) : fmt::format("<{}>", parameter.name);
    return fmt::format("{} is missing ({}): usage is {}", what, parameter.meaning, usage(*subcommand_));
  }

  const Subcommand* subcommand_;
  CLI::App* app_;
  std::vector<std::pair<const Parameter*, CLI::Option*>> options_;
};

// Where words end before they make a verb; `group` is the first of two, or "".
[[noreturn]] void refuse(const CLI::App& app, std::string_view group, std::span<const std::string_view> options) {
  const std::vector<std::string_view> words = words_after(group);
  const std::vector<std::string> remaining = app.remaining();
  if (remaining.empty()) {
    throw UsageError(fmt::format("what shall be done{}? Usage: absenc {}{}<verb> ..., where the verb is one of {}",
                                 group.empty() ? "" : fmt::format(" with the {}", group), group,
                                 group.empty() ? "" : " ", fmt::join(words, ", ")));
  }
  const std::string& word = remaining.front();
  const std::string of_group = group.empty() ? "" : fmt::format(" of {}", group);
  if (word.starts_with('-')) {
    throw UsageError(fmt::format("there is no option {}{}{}", word, of_group, suggestion(word, options)));
  }
  throw UsageError(fmt::format("there is no verb \"{}\"{}{}", word, of_group, suggestion(word, words)));
}

/// All subcommands in CLI11.
class CommandLine {
 public:
  CommandLine() {
    app_.set_help_flag("-h,--help");
    app_.add_flag("--version");
    accept_one(app_);
    for (const Subcommand* subcommand : all_subcommands()) {
      const std::string_view group = first_word(*subcommand);
      parsers_.push_back(std::make_unique<Parser>(group.empty() ? app_ : group_of(group), *subcommand));
    }
  }

  /// `understood` is the verb as far as it was found, also when this throws.
  int run(int argument_count, char** arguments, std::string& understood) {
    try {
      app_.parse(argument_count, arguments);
      find(understood);
    } catch (const CLI::CallForHelp&) {
      find(understood);
      print_line(chosen_ != nullptr ? help(chosen_->subcommand()) : understood.empty() ? help() : help(understood));
      return exit_good;
    } catch (const CLI::ArgumentMismatch& error) {
      find(understood);
      const std::string text = error.what();  // "--hex: 1 required  missing"
      throw UsageError(text.substr(0, text.find(':')) + " needs a value");
    } catch (const CLI::ParseError& error) {
      find(understood);
      throw UsageError(error.what());
    }
    if (app_.count("--version") > 0) {
      print_line("absenc " ABSENC_VERSION);
      return exit_good;
    }
    if (chosen_ != nullptr) return run_chosen();
    const std::vector<std::string_view> options{"--help", "--version"};
    if (understood.empty()) refuse(app_, {}, options);
    refuse(*groups_.at(understood), understood, std::span(options).first(1));
  }

 private:
  static void accept_one(CLI::App& app) {
    app.require_subcommand(0, 1);
    app.allow_extras();
  }

  CLI::App& group_of(std::string_view name) {
    CLI::App*& group = groups_[std::string(name)];
    if (group == nullptr) {
      group = app_.add_subcommand(std::string(name));
      accept_one(*group);
    }
    return *group;
  }

  void find(std::string& understood) {
    for (const auto& [name, group] : groups_) {
      if (group->parsed()) understood = name;
    }
    for (const auto& parser : parsers_) {
      if (!parser->parsed()) continue;
      chosen_ = parser.get();
      understood = parser->subcommand().name;
    }
  }

  int run_chosen() {
    const Invocation invocation = chosen_->invocation();
    try {
      return chosen_->subcommand().run(invocation);
    } catch (const CommandFailure& failure) {
      if (!invocation.has("--json")) throw;
      print_line(failure.trouble.json().line());
      return exit_failed;
    }
  }

  CLI::App app_;
  std::map<std::string, CLI::App*> groups_;  // by the first of two words
  std::vector<std::unique_ptr<Parser>> parsers_;
  const Parser* chosen_ = nullptr;
};

}  // namespace

}  // namespace absenc::tool

int main(int argument_count, char** arguments) {
  using namespace absenc::tool;
  std::string understood;
  try {
    absenc::os::protect_standard_streams();
    return CommandLine().run(argument_count, arguments, understood);
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
