// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/text_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "absenc/client/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/process.hpp"

namespace absenc::client {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t largest = 16 << 20;

}  // namespace

std::string read_text_file(std::string_view what, const std::string& path) {
  const auto refuse = [&](std::string_view why) {
    throw Failure(fmt::format("{} {} cannot be read: {}", what, path, why));
  };
  std::error_code ignored;
  if (fs::is_directory(os::path_of(path), ignored)) refuse("it is a directory");
  std::ifstream file(os::path_of(path), std::ios::binary);
  if (!file) refuse(std::strerror(errno));
  std::string text;
  for (std::array<char, 1 << 16> part; file; text.append(part.data(), static_cast<std::size_t>(file.gcount()))) {
    if (text.size() > largest) refuse("it has more than 16 MiB: it is something else, or never ends");
    file.read(part.data(), part.size());
  }
  if (file.bad()) refuse(std::strerror(errno));
  return text;
}

std::string link_target(const std::string& path) {
  std::error_code ignored;
  fs::path target = fs::absolute(os::path_of(path), ignored);
  for (int links = 0; links < 40 && fs::is_symlink(target, ignored); ++links) {
    target = target.parent_path() / fs::read_symlink(target, ignored);
  }
  return os::name_of(target);
}

void require_replaceable(const std::string& path) {
  const auto refuse = [&](std::string_view why) { throw Failure(fmt::format("{} cannot be written: {}", path, why)); };
  std::error_code ignored;
  const fs::path file = os::path_of(path);
  const fs::path folder = fs::absolute(file, ignored).parent_path();
  if (!fs::exists(file, ignored)) {
    if (!fs::is_directory(folder, ignored)) refuse(fmt::format("there is no directory {}", os::name_of(folder)));
    return;
  }
  if (!fs::is_regular_file(file, ignored)) refuse("it is no regular file");
  if (const int error = os::replaceable(path); error != 0) refuse(std::strerror(error));
}

bool SignificantLines::next() {
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

}  // namespace absenc::client
