// SPDX-License-Identifier: Apache-2.0
// Files of names and secrets (tokens, passwords) that users outside the group of the file must not read.
#pragma once

#include <string>
#include <vector>

namespace absenc::serve {

struct Secret {
  std::string name;
  std::string secret;
};

/// Reads a file of lines NAME SECRET and returns all of them. `least` is the minimum length of a secret; `title` names
/// the secrets in errors. Throws Failure if users outside the file's group may access the file, the group may write it,
/// a line is invalid, or the file has no line.
[[nodiscard]] std::vector<Secret> read_secrets(const std::string& title, const std::string& path, std::size_t least);

/// Reads a file with one line, and returns user name and password.
[[nodiscard]] Secret read_secret(const std::string& path);

}  // namespace absenc::serve
