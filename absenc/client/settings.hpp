// SPDX-License-Identifier: Apache-2.0
// What an encoder is set to: read by name, written and read back.
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

/// How a setting is written and how it is read: null when nothing reads it.
struct Setting {
  const Command* setter;  ///< Command that writes the setting; null: read only.
  const Command* getter;  ///< Command that reads the setting; null: write only.

  /// Returns the name of the setting.
  [[nodiscard]] std::string_view name() const { return getter != nullptr ? getter->name : setter->name; }
};

/// By which an encoder is asked what it is and what it is set to, in the order in which that is best told: commands
/// that need no argument.
[[nodiscard]] std::vector<const Command*> questions(const Unit& unit);
/// Those of them that there are with these options.
[[nodiscard]] std::vector<const Command*> questions(const Unit& unit, const Options& options);

/// Those that can be read, at least one. Throws UsageError.
[[nodiscard]] std::vector<const Command*> readable_settings(const Unit& unit);
/// Throws UsageError, which names the nearest, when there is none of that name; and when it cannot be read.
[[nodiscard]] const Command& require_readable_setting(const Unit& unit, std::string_view name);
/// Throws UsageError, which names the nearest, when there is none of that name; and when it can only be read.
[[nodiscard]] Setting require_setting(const Unit& unit, std::string_view name);

/// A setting with its values before and after.
struct SettingChange {
  Answer now;           ///< as the encoder tells when it is asked anew; of what cannot be read, as it was written
  bool was_so = false;  ///< nothing was sent, because it was so already
  ChangeState state = ChangeState::none;  ///< not_sent where it was so already
  std::string note{};                     ///< "from now on it is reached with address=3", or ""
};

class Encoder;

/// Of an open encoder (Encoder::settings), which must outlive it. Everything throws EncoderFailure when the encoder
/// fails, UsageError, and what the port throws.
class Settings {
 public:
  /// Reads and writes the settings of `encoder`, which must outlive this object.
  explicit Settings(Encoder& encoder) : encoder_(&encoder) {}

  /// Returns the value of a setting.
  [[nodiscard]] Answer get(std::string_view name);
  /// Writes, and compares what the encoder is set to then, value by value. Nobody is asked. What reaches the encoder
  /// by this setting reaches it by the new one. Throws also Failure: it says what was written, as far as that is known.
  SettingChange set(std::string_view name, std::span<const std::int64_t> arguments);

 private:
  Encoder* encoder_;
};

}  // namespace absenc::client
