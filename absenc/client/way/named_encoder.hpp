// SPDX-License-Identifier: Apache-2.0
// What a name of absenc.toml stands for, and the check that all of the file makes sense.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/client/way/settings_file.hpp"

namespace absenc::client {

struct NamedEncoder {
  std::string address;                // "tformat:/dev/ttyUSB0"
  std::string place;                  // where the file says where it is connected
  std::vector<FileSetting> settings;  // its own, and those of its bus that it does not override
  std::vector<FileSetting> defaults;  // that it may be given, where they fit
  bool has_company = false;           // other encoders are on its bus
  double rate_hz = 0;                 // how often a service shall read it; 0: the file does not say
};

/// Throws UsageError, which names the place in the file: settings that do not exist, protocols and buses that do not
/// exist, whether they are used or not: a misspelt name must not be silent, wherever it stands. Values are left to
/// whoever uses them, because they may depend on more than the file: the model behind `?`, a file of motion.
void check(const SettingsFile& config);

/// From a file that was checked. Throws UsageError, which names the nearest.
[[nodiscard]] NamedEncoder require_encoder(const SettingsFile& config, std::string_view name);

/// absenc.toml, checked; throws UsageError also when there is none: then `purpose` says who needs it.
[[nodiscard]] SettingsFile require_settings_file(std::string_view purpose);

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
