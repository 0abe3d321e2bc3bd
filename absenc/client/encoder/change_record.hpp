// SPDX-License-Identifier: Apache-2.0
// A change on its way into the journal: the value before is read before the change is sent.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/change.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/row.hpp"

namespace absenc::client {

class Connection;

class ChangeRecord {
 public:
  /// Reads what the command will overwrite, unless it is `known` or nothing reads it. Throws as the port does.
  ChangeRecord(Connection& connection, const Command& command, Arguments arguments, std::optional<std::int64_t> known);

  /// Appends it, if anything was sent. `way`: how the encoder was reached before. Returns "", or why the journal does
  /// not have it.
  [[nodiscard]] std::string keep(const EncoderAddress& way, const Change& change);

 private:
  [[nodiscard]] std::int64_t argument(Role role) const;
  [[nodiscard]] std::string what() const;
  [[nodiscard]] std::string after() const;
  void look_at_setting();
  void look_at_memory();
  void find_old_value(bool good);
  [[nodiscard]] std::string put_back(const EncoderAddress& way, bool moved) const;

  Connection& connection_;
  const Command& command_;
  std::vector<std::int64_t> arguments_;
  std::optional<Answer> old_{};              // of a setting: all of it
  std::optional<std::int64_t> old_value_{};  // that a command can write
};

}  // namespace absenc::client
