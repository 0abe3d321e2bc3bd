// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/help.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/os/serial_ports.hpp"

namespace absenc::tool {

namespace {

constexpr std::size_t text_width = 100;

// Wraps `text` into lines that begin at column `indent`.
std::string wrapped(std::string_view text, std::size_t indent) {
  std::string lines;
  std::size_t column = indent;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (column != indent && column + 1 + word.size() > text_width) {
      lines += '\n' + std::string(indent, ' ');
      column = indent;
    } else if (column != indent) {
      lines += ' ';
      ++column;
    }
    lines += word;
    column += word.size();
  }
  return lines;
}

std::string parameter_lines(std::span<const Parameter> parameters, bool options) {
  constexpr std::size_t indent = 24;
  std::string text;
  for (const Parameter& parameter : parameters) {
    if (parameter.is_option() != options) continue;
    const std::string left = fmt::format("  {:<{}}", title(parameter), indent - 4);
    text += left;
    text += left.size() < indent - 1 ? std::string(indent - left.size(), ' ') : '\n' + std::string(indent, ' ');
    text += wrapped(words(parameter), indent) + '\n';
  }
  return text;
}

}  // namespace

std::string with_ports_of_this_system(std::string_view written) {
  std::string text(written);
  for (const unsigned which : {0u, 1u}) {
    const std::string port = fmt::format("/dev/ttyUSB{}", which);
    const std::string here = os::example_port(which);
    for (std::size_t at = text.find(port); at != std::string::npos; at = text.find(port, at + here.size())) {
      text.replace(at, port.size(), here);
    }
  }
  return text;
}

std::string example_lines(std::span<const Example> examples) {
  std::string text;
  for (const Example& example : examples) text += fmt::format("  {}\n      {}\n", example.command, example.meaning);
  return text;
}

std::string title(const Parameter& parameter) {
  if (!parameter.is_option()) return fmt::format("<{}>{}", parameter.name, parameter.repeatable ? "..." : "");
  if (parameter.value.empty()) return std::string(parameter.name);
  return fmt::format("{} {}", parameter.name, parameter.value);
}

std::string words(const Parameter& parameter) {
  std::string text(parameter.meaning);
  if (parameter.is_option() && parameter.repeatable) text += "; may be given more than once";
  if (!parameter.fallback.empty()) text += fmt::format(" (default: {})", parameter.fallback);
  return text;
}

std::string usage(const Subcommand& subcommand) {
  std::string text = fmt::format("absenc {}", subcommand.name);
  for (const Parameter& parameter : subcommand.parameters) {
    if (parameter.is_option()) continue;
    text += parameter.required ? fmt::format(" {}", title(parameter)) : fmt::format(" [{}]", title(parameter));
  }
  const bool has_options = std::any_of(subcommand.parameters.begin(), subcommand.parameters.end(),
                                       [](const Parameter& parameter) { return parameter.is_option(); });
  return has_options ? text + " [options]" : text;
}

std::string help(const Subcommand& subcommand) {
  std::string text = fmt::format("{}\n\nUsage: {}\n", subcommand.summary, usage(subcommand));
  if (!subcommand.description.empty()) text += fmt::format("\n{}\n", subcommand.description);
  const std::string arguments = parameter_lines(subcommand.parameters, false);
  if (!arguments.empty()) text += fmt::format("\nArguments:\n{}", arguments);
  text +=
      fmt::format("\nOptions:\n{}{:<24}{}\n", parameter_lines(subcommand.parameters, true), "  --help", "this text");
  return with_ports_of_this_system(text + fmt::format("\nExamples:\n{}", example_lines(subcommand.examples)));
}

}  // namespace absenc::tool
