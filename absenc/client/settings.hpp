// SPDX-License-Identifier: Apache-2.0
// Settings of an encoder, which are read by name, written, and read back.
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

/// A setting, with the commands that write and read it.
struct Setting {
  const Command* setter;  ///< Command that writes the setting; null: the setting can only be read.
  const Command* getter;  ///< Command that reads the setting; null: the setting can only be written.

  /// Returns the name of the command that reads the setting or, if there is none, of the command that writes it.
  [[nodiscard]] std::string_view name() const { return getter != nullptr ? getter->name : setter->name; }
};

/// Returns commands that read identity, temperature and settings and need no arguments.
[[nodiscard]] std::vector<const Command*> questions(const Unit& unit);
/// Returns those commands of `questions(unit)` that exist with these options.
[[nodiscard]] std::vector<const Command*> questions(const Unit& unit, const Options& options);

/// Returns the commands that read the unit's settings. Throws UsageError if there are none.
[[nodiscard]] std::vector<const Command*> readable_settings(const Unit& unit);
/// Returns the command that reads the setting `name`. Throws UsageError.
[[nodiscard]] const Command& require_readable_setting(const Unit& unit, std::string_view name);
/// Returns the setting `name`, which can be written. Throws UsageError.
[[nodiscard]] Setting require_setting(const Unit& unit, std::string_view name);

/// Result of writing a setting.
struct SettingChange {
  Answer now;           ///< Value of the setting that was read back; if the setting cannot be read, the written value.
  bool was_so = false;  ///< Whether no write was sent, because the encoder already had this value.
  ChangeState state = ChangeState::none;  ///< State of the change; not_sent if the encoder already had this value.
  /// Sentence about the option with which the encoder is reached from now on; "": unchanged.
  std::string note{};
};

class Encoder;

/// Access to the settings of an open encoder. Functions throw UsageError, EncoderFailure, Failure and exceptions of the
/// port.
class Settings {
 public:
  /// Reads and writes the settings of `encoder`, which must outlive this object.
  explicit Settings(Encoder& encoder) : encoder_(&encoder) {}

  /// Reads the setting `name` and returns its value.
  [[nodiscard]] Answer get(std::string_view name);
  /// Writes the setting `name`, reads it back if it can be read, and returns the result. Does not ask for confirmation.
  SettingChange set(std::string_view name, std::span<const std::int64_t> arguments);

 private:
  Encoder* encoder_;
};

}  // namespace absenc::client
