// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "absenc/client/port/address.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/help.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

/// A parser of the words after a verb. If an option has a wrong name and a parameter is missing, it reports the wrong
/// name.
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

}  // namespace

bool asks_for_help(std::string_view word) { return word == "--help" || word == "-h"; }

std::optional<Invocation> parse_arguments(const Subcommand& subcommand, std::span<char* const> words) {
  return ArgumentParser(subcommand).parse(words);
}

int run_guarded(const std::function<int()>& work, const std::string& understood) {
  try {
    os::protect_standard_streams();
    return work();
  } catch (const UsageError& error) {
    print_message(error.what());
    print_note(fmt::format("Try: absenc {}{}--help", understood, understood.empty() ? "" : " "));
    return exit_usage;
  } catch (const OutputClosed&) {
    return exit_good;
  } catch (const os::Interrupted&) {
    print_message("interrupted");
    return exit_failed;
  } catch (const std::exception& error) {
    print_message(error.what());
    return exit_failed;
  }
}

}  // namespace absenc::tool
