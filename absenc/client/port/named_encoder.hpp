// SPDX-License-Identifier: Apache-2.0
// What a name of absenc.toml stands for, and the check that all of the file makes sense.
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/client/port/settings_file.hpp"

namespace absenc::client {

struct NamedEncoder {
  std::string address;                // "tformat:/dev/ttyUSB0"
  std::string place;                  // where the file says where it is connected
  std::vector<FileSetting> settings;  // its own, and those of its bus that it does not override
  std::vector<FileSetting> defaults;  // that it may be given, where they fit
  bool has_company = false;           // other encoders are on its bus
  double rate_hz = 0;                 // how often a service shall read it; 0: the file does not say
};

/// A file that was checked, by its names: read once for all of them.
class NamedEncoders {
 public:
  /// Throws UsageError, which names the place in the file: settings that do not exist, protocols and buses that do not
  /// exist, whether they are used or not: a misspelt name must not be silent, wherever it stands. Values are left to
  /// whoever uses them, because they may depend on more than the file: the model behind `?`, a file of motion.
  explicit NamedEncoders(SettingsFile file);
  NamedEncoders(NamedEncoders&&) noexcept = default;
  NamedEncoders& operator=(NamedEncoders&&) noexcept = default;
  NamedEncoders(const NamedEncoders&) = delete;  // the indices point into the file
  NamedEncoders& operator=(const NamedEncoders&) = delete;
  ~NamedEncoders() = default;

  [[nodiscard]] const SettingsFile& file() const { return file_; }
  /// Throws UsageError, which names the nearest.
  [[nodiscard]] NamedEncoder require(std::string_view name) const;

 private:
  using Index = std::unordered_map<std::string_view, const FileSection*>;
  void check_line(const FileSection& encoder) const;
  void check_encoder(const FileSection& encoder) const;

  SettingsFile file_;
  Index buses_;
  Index encoders_;
  std::unordered_map<std::string_view, std::size_t> on_bus_;  // how many encoders
};

/// absenc.toml; throws UsageError also when there is none: then `purpose` says who needs it.
[[nodiscard]] NamedEncoders require_names(std::string_view purpose);

/// Does the work; a UsageError gets the place put before it.
template <class Work>
auto at(const std::string& place, const Work& work) {
  try {
    return work();
  } catch (const UsageError& error) {
    throw UsageError(place + ": " + error.what());
  }
}

}  // namespace absenc::client
