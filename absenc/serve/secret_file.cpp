// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/secret_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/client/error.hpp"
#include "absenc/client/text/text_file.hpp"
#include "absenc/os/private_file.hpp"

namespace absenc::serve {

using namespace client;

std::vector<Secret> read_secrets(const std::string& title, const std::string& path, std::size_t least) {
  const std::string text = read_text_file("the " + title + "s", path);
  if (const std::string command = os::command_to_deny_others(path); !command.empty()) {
    throw Failure(fmt::format("others may read or write the {}s in {}: {}", title, path, command));
  }
  std::vector<Secret> secrets;
  for (SignificantLines lines(text); lines.next();) {
    const std::size_t space = lines.line.find_first_of(" \t");
    const std::size_t secret = std::min(lines.line.find_first_not_of(" \t", space), lines.line.size());
    if (space == std::string_view::npos || lines.line.size() - secret < least) {
      throw Failure(fmt::format("{}:{}: a line must be NAME and {}, which has {} characters or more", path,
                                lines.number, title, least));
    }
    secrets.push_back({std::string(lines.line.substr(0, space)), std::string(lines.line.substr(secret))});
  }
  if (secrets.empty()) throw Failure(fmt::format("there is no {} in {}: lines of NAME and {}", title, path, title));
  return secrets;
}

Secret read_secret(const std::string& path) { return read_secrets("password", path, 1).front(); }

}  // namespace absenc::serve
