// SPDX-License-Identifier: Apache-2.0
// Reads absenc.toml into data.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::client {

/// A setting of the file. Its values are texts, as behind ? in an address.
struct FileSetting {
  std::string name;
  std::vector<std::string> values;  // the value of the setting; any number of values if it is a list
  std::string place;                // position of the setting's name, "absenc.toml:3:1": file, line and column
  bool is_list = false;
};

struct FileSection {
  std::string name;
  std::vector<FileSetting> settings;  // settings of the section, in the order of the file
  std::string place;

  /// Returns the setting of this name; null if the section does not have it.
  [[nodiscard]] const FileSetting* find(std::string_view setting) const;
};

struct SettingsFile {
  std::string path;
  FileSection defaults;               // content of the section [defaults]
  std::vector<FileSection> buses;     // the sections [bus.NAME], in the order of the file
  std::vector<FileSection> encoders;  // the sections [encoder.NAME], in the order of the file
  std::vector<FileSection> services;  // the sections [serve.NAME], in the order of the file
};

/// Parses the text of absenc.toml; `path` is its name in errors. Throws UsageError.
using SettingsParser = SettingsFile (*)(std::string_view text, const std::string& path);
/// Sets the parser of this program. Call it before threads are started.
void set_settings_parser(SettingsParser parser);
/// Returns whether this program has a parser, so that it reads absenc.toml.
[[nodiscard]] bool reads_settings_file();

/// Returns the paths at which absenc.toml may be, in order of priority.
[[nodiscard]] std::vector<std::string> settings_file_paths();

/// Reads the first file that exists; nothing: there is none, or this program does not read it. Throws UsageError.
[[nodiscard]] std::optional<SettingsFile> load_settings_file();

}  // namespace absenc::client
