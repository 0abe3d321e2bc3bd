// SPDX-License-Identifier: Apache-2.0
// Settings of an encoder: read by name, written, and read back.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/change.hpp"
#include "absenc/client/row.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// The commands that write and read a setting.
struct Setting {
  const Command* setter;  ///< Command that writes the setting; null: read only.
  const Command* getter;  ///< Command that reads the setting; null: write only.

  /// Returns the name of the setting.
  [[nodiscard]] std::string_view name() const { return getter != nullptr ? getter->name : setter->name; }
};

/// Returns the commands that read identity and settings of an encoder without arguments, in the order for a report.
[[nodiscard]] std::vector<const Command*> questions(const Unit& unit);
/// Returns those of these commands that exist with the options.
[[nodiscard]] std::vector<const Command*> questions(const Unit& unit, const Options& options);

/// Returns the settings that can be read, at least one. Throws UsageError if there are none.
[[nodiscard]] std::vector<const Command*> readable_settings(const Unit& unit);
/// Returns the command that reads the setting. Throws UsageError, which suggests the nearest name, if the setting does
/// not exist or cannot be read.
[[nodiscard]] const Command& require_readable_setting(const Unit& unit, std::string_view name);
/// Returns the setting. Throws UsageError, which suggests the nearest name, if the setting does not exist or is read
/// only.
[[nodiscard]] Setting require_setting(const Unit& unit, std::string_view name);

/// A setting with its values before and after.
struct SettingChange {
  Answer now;           ///< Value that was read back; for a setting that cannot be read, the written value.
  bool was_so = false;  ///< Nothing was sent, because the encoder had this value already.
  ChangeState state = ChangeState::none;  ///< State of the change; not_sent if the encoder had this value already.
  /// A sentence about a new address, "from now on it is reached with address=3", or "".
  std::string note{};
};

class Encoder;

/// The settings of an open encoder, from Encoder::settings. Functions throw EncoderFailure if a command fails,
/// UsageError, and exceptions of the port.
class Settings {
 public:
  /// Reads and writes the settings of `encoder`, which must outlive this object.
  explicit Settings(Encoder& encoder) : encoder_(&encoder) {}

  /// Returns the value of a setting.
  [[nodiscard]] Answer get(std::string_view name);
  /// Writes a setting without confirmation by the user, reads it back and compares value by value. If the setting
  /// changes how the encoder is reached, the connection uses the new value. Also throws Failure, whose text states what
  /// was written, as far as it is known.
  SettingChange set(std::string_view name, std::span<const std::int64_t> arguments);

 private:
  Encoder* encoder_;
};

}  // namespace absenc::client
