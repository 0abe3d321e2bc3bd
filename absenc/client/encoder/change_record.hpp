// SPDX-License-Identifier: Apache-2.0
// Writes a change of an encoder into the journal, with the old value if it is known or was read before the change.
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
  /// If there is a journal, reads the value that the command will overwrite, which must be a setting that can be read,
  /// or a byte of the memory; not if it is `known`. Throws the exceptions of the port.
  ChangeRecord(Connection& connection, const Command& command, Arguments arguments, std::optional<std::int64_t> known);

  /// Appends the change to the journal if there is one and the request of the change was sent. `way` is the encoder's
  /// address before the change. Returns "", or the reason why the change could not be written.
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
  std::optional<Answer> old_{};              // old value of a setting, as all fields of the reply
  std::optional<std::int64_t> old_value_{};  // old value, in the form that the command can write
};

}  // namespace absenc::client
