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
/// the secrets in errors. Throws Failure if the file cannot be read, users outside its group may access it, the group
/// may write it, a line is invalid, or the file has no line.
[[nodiscard]] std::vector<Secret> read_secrets(const std::string& title, const std::string& path, std::size_t least);

/// Returns user name and password from the first line of the file at `path` that is neither empty nor begins with #.
/// Throws as `read_secrets` does.
[[nodiscard]] Secret read_secret(const std::string& path);

}  // namespace absenc::serve
