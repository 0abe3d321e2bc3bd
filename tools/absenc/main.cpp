// SPDX-License-Identifier: Apache-2.0
// The command line. The only file that includes CLI11: it is slow to compile.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "absenc/os/error.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/help.hpp"
#include "tools/absenc/nearest.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

namespace {

/// The options and arguments of one subcommand in CLI11. What is missing or too much is found here and not there,
/// so that a wrong name is reported before what is missing because of it.
class Parser {
 public:
  Parser(CLI::App& app, const Subcommand& subcommand)
      : subcommand_(&subcommand), app_(app.add_subcommand(std::string(subcommand.name))) {
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

// Without a verb.
int answer(const CLI::App& app) {
  std::vector<std::string_view> names;
  for (const Subcommand* subcommand : all_subcommands()) names.push_back(subcommand->name);
  const std::vector<std::string> words = app.remaining();
  if (words.empty()) {
    throw UsageError(fmt::format("what shall be done? Usage: absenc <verb> ..., where the verb is one of {}",
                                 fmt::join(names, ", ")));
  }
  const std::string& word = words.front();
  if (word.starts_with('-')) {
    const std::vector<std::string_view> options{"--help", "--version"};
    throw UsageError(fmt::format("there is no option {}{}", word, suggestion(word, options)));
  }
  throw UsageError(fmt::format("there is no verb \"{}\"{}", word, suggestion(word, names)));
}

int run(int argument_count, char** arguments, const Subcommand*& chosen) {
  CLI::App app;
  app.require_subcommand(0, 1);
  app.allow_extras();
  app.set_help_flag("-h,--help");
  app.add_flag("--version");
  std::vector<std::unique_ptr<Parser>> parsers;
  for (const Subcommand* subcommand : all_subcommands()) parsers.push_back(std::make_unique<Parser>(app, *subcommand));
  const auto find_chosen = [&] {
    for (const auto& parser : parsers) {
      if (parser->parsed()) chosen = &parser->subcommand();
    }
  };
  try {
    app.parse(argument_count, arguments);
    find_chosen();
  } catch (const CLI::CallForHelp&) {
    find_chosen();
    print_line(chosen != nullptr ? help(*chosen) : help());
    return exit_good;
  } catch (const CLI::ArgumentMismatch& error) {
    find_chosen();
    const std::string text = error.what();  // "--hex: 1 required  missing"
    throw UsageError(text.substr(0, text.find(':')) + " needs a value");
  } catch (const CLI::ParseError& error) {
    find_chosen();
    throw UsageError(error.what());
  }
  if (app.count("--version") > 0) {
    print_line("absenc " ABSENC_VERSION);
    return exit_good;
  }
  for (const auto& parser : parsers) {
    if (parser->parsed()) return chosen->run(parser->invocation());
  }
  return answer(app);
}

}  // namespace

}  // namespace absenc::tool

int main(int argument_count, char** arguments) {
  using namespace absenc::tool;
  const Subcommand* chosen = nullptr;
  try {
    absenc::os::protect_standard_streams();
    return run(argument_count, arguments, chosen);
  } catch (const UsageError& error) {
    print_message(error.what());
    print_note(
        fmt::format("Try: absenc {}{}--help", chosen != nullptr ? chosen->name : "", chosen != nullptr ? " " : ""));
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
