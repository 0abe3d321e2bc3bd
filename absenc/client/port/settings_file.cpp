// SPDX-License-Identifier: Apache-2.0
// Finds absenc.toml and reads it with the parser of client/configuration, if the program has it.
#include "absenc/client/port/settings_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "absenc/client/error.hpp"
#include "absenc/client/text/text_file.hpp"

namespace absenc::client {

namespace {

constexpr const char* variable = "ABSENC_CONFIG";

SettingsParser parse = nullptr;

// Returns the value of the environment variable; "" if it is not set.
std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

const FileSetting* FileSection::find(std::string_view setting) const {
  const auto found =
      std::find_if(settings.begin(), settings.end(), [&](const FileSetting& one) { return one.name == setting; });
  return found == settings.end() ? nullptr : &*found;
}

std::vector<std::string> settings_file_paths() {
  if (const std::string path = environment(variable); !path.empty()) return {path};
  std::vector<std::string> paths{"absenc.toml"};
  // Ignores a relative path, as the XDG Base Directory Specification requires.
  std::string folder = environment("XDG_CONFIG_HOME");
  if (!folder.starts_with('/')) {
    const std::string home = environment("HOME");
    folder = home.empty() ? "" : home + "/.config";
  }
  if (!folder.empty()) paths.push_back(folder + "/absenc/absenc.toml");
  return paths;
}

void set_settings_parser(SettingsParser parser) { parse = parser; }

bool reads_settings_file() { return parse != nullptr; }

std::optional<SettingsFile> load_settings_file() {
  if (parse == nullptr) return std::nullopt;
  const bool must_exist = !environment(variable).empty();
  for (const std::string& path : settings_file_paths()) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::symlink_status(path, ignored).type() != fs::file_type::not_found) {
      const fs::file_type type = fs::status(path, ignored).type();
      // the file type is `none` for a symbolic link that leads to itself
      if (type == fs::file_type::not_found || type == fs::file_type::none) {
        throw UsageError(fmt::format("{} is a link that leads to no file: correct it or remove it", path));
      }
      // reading a FIFO or a socket might wait forever for a writer
      if (type == fs::file_type::fifo || type == fs::file_type::socket) {
        throw UsageError(fmt::format("{} is no regular file: write the encoders' names into a file", path));
      }
      try {
        return parse(read_text_file("the file of encoders' names", path), path);
      } catch (const Failure& failure) {
        throw UsageError(failure.what());
      }
    }
    if (must_exist) throw UsageError(fmt::format("{}, which {} names, is not there", path, variable));
  }
  return std::nullopt;
}

}  // namespace absenc::client
