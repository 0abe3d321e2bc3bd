// SPDX-License-Identifier: Apache-2.0
// Files of names with their secrets, for their owner alone.
#pragma once

#include <string>
#include <vector>

namespace absenc::serve {

struct Secret {
  std::string name;
  std::string secret;
};

/// Lines of NAME SECRET, of at least `least` characters; `title` names them in what is thrown. Throws Failure when
/// others may read the file, when a line is no such, and when there is none.
[[nodiscard]] std::vector<Secret> read_secrets(const std::string& title, const std::string& path, std::size_t least);

/// A file of one: a user's name and password.
[[nodiscard]] Secret read_secret(const std::string& path);

}  // namespace absenc::serve
