// SPDX-License-Identifier: Apache-2.0
// Files of names and secrets (tokens, passwords).
#pragma once

#include <string>
#include <vector>

namespace absenc::serve {

struct Secret {
  std::string name;
  std::string secret;
};

/// Reads a file of lines NAME SECRET. `least`: minimum length of a secret; `title`: name of the secrets in errors.
/// Throws Failure, also if the file's group may write it, or others may access it.
[[nodiscard]] std::vector<Secret> read_secrets(const std::string& title, const std::string& path, std::size_t least);

/// Returns the first user name and its password in a file. Throws Failure.
[[nodiscard]] Secret read_secret(const std::string& path);

}  // namespace absenc::serve
