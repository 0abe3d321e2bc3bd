// SPDX-License-Identifier: Apache-2.0
// Resolves the names of encoders in absenc.toml and checks the sections that describe encoders.
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/client/port/settings_file.hpp"

namespace absenc::client {

struct NamedEncoder {
  std::string address;  // address without settings, "tformat:/dev/ttyUSB0"
  std::string place;    // place in absenc.toml at which the port of the encoder is given, for error messages
  // settings in the section of the encoder, and those in the section of its bus that the encoder's section does not set
  std::vector<FileSetting> settings;
  // settings in the section [defaults]; settings that this encoder cannot have are ignored
  std::vector<FileSetting> defaults;
  bool has_company = false;  // whether other encoders in absenc.toml are on the same bus
  double rate_hz = 0;        // readings per second for `serve`; 0: not in the file
};

/// The encoders of absenc.toml. The file is read and checked only once for all of them.
class NamedEncoders {
 public:
  /// Takes the content of absenc.toml and checks its names. Throws UsageError.
  explicit NamedEncoders(SettingsFile file);
  NamedEncoders(NamedEncoders&&) noexcept = default;
  NamedEncoders& operator=(NamedEncoders&&) noexcept = default;
  NamedEncoders(const NamedEncoders&) = delete;  // no copies: the maps refer to strings in `file_`
  NamedEncoders& operator=(const NamedEncoders&) = delete;
  ~NamedEncoders() = default;

  [[nodiscard]] const SettingsFile& file() const { return file_; }
  /// Returns the encoder of this name with its settings. Throws UsageError.
  [[nodiscard]] NamedEncoder require(std::string_view name) const;

 private:
  using SectionsByName = std::unordered_map<std::string_view, const FileSection*>;
  void check_line(const FileSection& encoder) const;
  void check_encoder(const FileSection& encoder) const;

  SettingsFile file_;
  SectionsByName buses_;
  SectionsByName encoders_;
  std::unordered_map<std::string_view, std::size_t> on_bus_;  // number of encoders on each bus, by the bus's name
};

/// Reads absenc.toml; `purpose` says why it is needed. Throws UsageError.
[[nodiscard]] NamedEncoders require_names(std::string_view purpose);

/// Calls a function, and puts `place` before the text of a UsageError that it throws.
template <class Work>
auto at(const std::string& place, const Work& work) {
  try {
    return work();
  } catch (const UsageError& error) {
    throw UsageError(place + ": " + error.what());
  }
}

}  // namespace absenc::client
