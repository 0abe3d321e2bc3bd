// SPDX-License-Identifier: Apache-2.0
// Orders for an encoder: to run a command, to read its settings or memory, or to examine it.
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

/// Result of an order, with a text for people.
struct OrderResult {
  bool good = false;
  std::string text{};
  client::Json json{};  // fields of the reply to a command; for other orders the whole response
  client::ChangeState change = client::ChangeState::none;
};

struct Order {
  enum class Kind : std::uint8_t {
    command,
    settings,     // reads settings and identification; if `command` is set, only the value that this command reads
    memory,       // reads the memory bytes at `addresses`; for encoders with registers, all readable registers
    examination,  // runs the examination of `absenc doctor`
  };

  Kind kind = Kind::command;
  const Command* command = nullptr;
  std::vector<std::int64_t> arguments{};
  client::MemoryImage addresses{};
  std::string who{};
  // called once if Watch::give accepts the order: when the order has ended or was given up
  std::function<void(const OrderResult&)> done{};

  /// Returns the name of the order for messages: "zero", "doctor".
  [[nodiscard]] std::string_view name() const;
  [[nodiscard]] bool changes_encoder() const { return kind == Kind::command && command->changes_encoder; }
};

/// Returns an order that reads settings and identification; if `setting` is not "", only this setting. Throws
/// UsageError.
[[nodiscard]] Order settings_order(const Unit& unit, std::string_view setting);
/// Returns an order that reads all registers if the unit has registers, otherwise the memory page `page`; a page
/// below 0 means all addresses that `absenc memory dump` reads. Throws UsageError.
[[nodiscard]] Order memory_order(const Unit& unit, std::int64_t page);
[[nodiscard]] Order examination_order();

/// Carries out an order of any kind except an examination. `between`, which may do other work on the line, may be
/// called between two requests. Throws the exceptions of the encoder, its port and `between`.
[[nodiscard]] OrderResult carry_out(client::Encoder& encoder, const Order& order, const std::function<void()>& between);

/// Returns the fields of a reply as texts for people, as a list of {"field","value","meaning"}. Fields with the role
/// Role::exchange are left out.
[[nodiscard]] client::Json shown_values(const client::Answer& answer);

/// Returns what can be read from a unit: {"settings":[names],"memory":[areas],"registers":count}.
[[nodiscard]] client::Json readable_json(const Unit& unit);

}  // namespace absenc::serve
