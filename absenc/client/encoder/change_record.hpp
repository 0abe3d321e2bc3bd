// SPDX-License-Identifier: Apache-2.0
// Writes a change of an encoder into the journal.
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
  /// Reads, if necessary, the value that the command will overwrite.
  ChangeRecord(Connection& connection, const Command& command, Arguments arguments, std::optional<std::int64_t> known);

  /// Adds the change to the journal; returns "" or why it could not be written.
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
  std::optional<Answer> old_{};  // value of the setting before the change, as all fields of the reply
  // value before the change, as an argument with which the command restores it
  std::optional<std::int64_t> old_value_{};
};

}  // namespace absenc::client
