// SPDX-License-Identifier: Apache-2.0
// Orders for an encoder besides its readings: a command, its settings, its memory, an examination.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/encoder.hpp"
#include "absenc/client/memory.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::serve {

/// Result of an order: whether it succeeded, a text for people, the data, and the state of a change.
struct OrderResult {
  bool good = false;
  std::string text{};
  client::Json json{};  // fields of the reply to a command; for other orders the whole response
  client::ChangeState change = client::ChangeState::none;
};

struct Order {
  enum class Kind : std::uint8_t {
    command,
    settings,  // reads all settings and identification; if `command` is set, only the setting that this command reads
    memory,    // reads the memory bytes at `addresses`; for encoders with registers, all readable registers
    examination,  // runs the examination of `absenc doctor`
  };

  Kind kind = Kind::command;
  const Command* command = nullptr;
  std::vector<std::int64_t> arguments{};
  client::MemoryImage addresses{};
  std::string who{};
  // called once if Watch::give accepts the order: when the order has ended, or is given up
  std::function<void(const OrderResult&)> done{};

  /// Returns the name of the order for messages: "zero", "doctor".
  [[nodiscard]] std::string_view name() const;
  [[nodiscard]] bool changes_encoder() const { return kind == Kind::command && command->changes_encoder; }
};

/// Returns an order that reads settings. `setting` names the command that reads one setting; "": all settings and the
/// identification. Throws UsageError if the unit has none of these, or not this setting.
[[nodiscard]] Order settings_order(const Unit& unit, std::string_view setting);
/// Returns an order that reads memory page `page`; below 0: the addresses that a memory dump contains. Throws
/// UsageError if the unit has no such memory, or the addresses are too many for one request. For a unit with registers
/// the order reads all readable ones.
[[nodiscard]] Order memory_order(const Unit& unit, std::int64_t page);
[[nodiscard]] Order examination_order();

/// Carries out any order but an examination and returns its result. `between` is called between two requests of an
/// order that reads, and may read the position. Throws the exceptions of the encoder and its port; a failed request for
/// a setting or a register does not end the order.
[[nodiscard]] OrderResult carry_out(client::Encoder& encoder, const Order& order, const std::function<void()>& between);

/// Returns the fields of a reply for people as a list of {"field","value","meaning"}, without the fields that describe
/// the exchange; an invalid value is null.
[[nodiscard]] client::Json shown_values(const client::Answer& answer);

/// Returns the names of the commands that read the settings and the identification of an encoder of this unit, and its
/// memory: {"settings":[names],"memory":[{"page","pages","first","count","meaning","in_dump"}],"registers":n}
[[nodiscard]] client::Json readable_json(const Unit& unit);

}  // namespace absenc::serve
