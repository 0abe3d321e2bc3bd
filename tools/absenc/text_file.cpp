// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tools/absenc/error.hpp"

namespace absenc::tool {

namespace fs = std::filesystem;

std::string read_text_file(std::string_view what, const std::string& path) {
  const auto refuse = [&](std::string_view why) {
    throw ToolFailure(fmt::format("{} {} cannot be read: {}", what, path, why));
  };
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) refuse("it is a directory");
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(std::strerror(errno));
  std::ostringstream text;
  text << file.rdbuf();  // fails for an empty file, too
  if (file.bad()) refuse(std::strerror(errno));
  return text.str();
}

std::string link_target(const std::string& path) {
  std::error_code ignored;
  fs::path target = fs::absolute(path, ignored);
  for (int links = 0; links < 40 && fs::is_symlink(target, ignored); ++links) {
    target = target.parent_path() / fs::read_symlink(target, ignored);
  }
  return target;
}

bool LineReader::next() {
  while (!rest_.empty()) {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number;
    while (line.ends_with('\r') || line.ends_with(' ') || line.ends_with('\t')) line.remove_suffix(1);
    if (!line.empty() && !line.starts_with('#')) return true;
  }
  return false;
}

}  // namespace absenc::tool
