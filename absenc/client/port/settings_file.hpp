// SPDX-License-Identifier: Apache-2.0
// absenc.toml as data: the names it gives to encoders and buses, and what stands below them. The library that reads
// TOML is seen by settings_file.cpp alone.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::client {

/// Values are texts, as they would stand behind ? in an encoder.
struct FileSetting {
  std::string name;
  std::vector<std::string> values;  // one, or those of a list
  std::string place;                // "absenc.toml:3:1": file, line and column of the name
  bool is_list = false;
};

struct FileSection {
  std::string name;
  std::vector<FileSetting> settings;  // in the order of the file
  std::string place;

  /// Null when it is not there.
  [[nodiscard]] const FileSetting* find(std::string_view setting) const;
};

struct SettingsFile {
  std::string path;
  FileSection defaults;               // [defaults]
  std::vector<FileSection> buses;     // [bus.NAME]
  std::vector<FileSection> encoders;  // [encoder.NAME]
  std::vector<FileSection> services;  // [serve.NAME]
};

/// Syntax, sections and types are right afterwards, what stands in the sections is not looked at. Throws UsageError,
/// which begins with the place in the file.
[[nodiscard]] SettingsFile parse_settings_file(std::string_view text, const std::string& path);

/// Where absenc.toml is looked for, in this order: the file that ABSENC_CONFIG names and no other, or the working
/// directory and the user's configuration.
[[nodiscard]] std::vector<std::string> settings_file_paths();

/// The first that is there; none: nullopt. Throws UsageError also when the file of ABSENC_CONFIG is not there, or one
/// that is there cannot be read, is a link that leads nowhere, or a FIFO: it is never passed over for the next.
[[nodiscard]] std::optional<SettingsFile> load_settings_file();

}  // namespace absenc::client
