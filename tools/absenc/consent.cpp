// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/consent.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <string>

#include "absenc/os/error.hpp"
#include "absenc/os/input.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

bool is_yes(std::string_view answer) {
  std::string word(answer.substr(std::min(answer.find_first_not_of(" \t"), answer.size())));
  word.erase(word.find_last_not_of(" \t\r") + 1);
  std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
  return word == "y" || word == "yes";
}

bool says_yes(const std::string& question) {
  print_prompt(question);
  std::array<std::uint8_t, 256> line;  // a terminal hands out whole lines
  try {
    const std::size_t size = os::read_standard_input(line, never).value_or(0);
    std::string_view answer(reinterpret_cast<const char*>(line.data()), size);
    return is_yes(answer.substr(0, answer.find('\n')));
  } catch (const os::Interrupted&) {
    print_note("");
    throw;
  }
}

bool disturbs(const EncoderAddress& uri, const Command& command) {
  return !command.disturbs.empty() && uri.port_kind != PortKind::sim;
}

}  // namespace

bool must_ask(const Invocation& invocation, const EncoderAddress& uri, std::string_view what,
              std::string_view meaning) {
  // A sim: encoder disappears after the command, so no confirmation is needed.
  if (uri.port_kind == PortKind::sim || invocation.has("--yes")) return false;
  if (can_ask()) return true;
  throw UsageError(
      fmt::format("{} changes the encoder ({}) and nobody is there to be asked: give --yes to do it", what, meaning));
}

bool confirmed(const EncoderAddress& uri, std::string_view meaning) {
  const std::string where = uri.port_kind == PortKind::tcp ? fmt::format("{}:{}", uri.host, uri.port) : uri.path;
  return says_yes(fmt::format("This changes the encoder at {}: {}. Go on? [y/N] ", where, meaning));
}

void tell_disturbance(const EncoderAddress& uri, const Command& command) {
  if (disturbs(uri, command)) print_message(fmt::format("{}: {}", command.name, command.disturbs));
}

bool may_disturb(const Invocation& invocation, const EncoderAddress& uri, const Command& command) {
  tell_disturbance(uri, command);
  if (!disturbs(uri, command) || invocation.has("--yes")) return true;
  if (!can_ask()) {
    throw UsageError(
        fmt::format("nobody is there to be asked whether {} may disturb them: give --yes to do it", command.name));
  }
  if (says_yes("Go on? [y/N] ")) return true;
  print_message("nothing was sent");
  return false;
}

}  // namespace absenc::tool
