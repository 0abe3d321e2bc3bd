// SPDX-License-Identifier: Apache-2.0
// What somebody wants of an encoder beside its readings: a command, its settings, its memory, an examination.
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

/// How it ended.
struct Done {
  bool good = false;
  std::string text{};
  client::Json json{};  // of a command its fields
  client::ChangeState change = client::ChangeState::none;
};

struct Order {
  enum class Kind : std::uint8_t {
    command,
    settings,     // all that can be read, and what it says of itself; with `command` that alone
    memory,       // the bytes of `addresses`; of encoders with registers all that can be read
    examination,  // as `absenc doctor`
  };

  Kind kind = Kind::command;
  const Command* command = nullptr;
  std::vector<std::int64_t> arguments{};
  client::MemoryImage addresses{};
  std::string who{};
  std::function<void(const Done&)> done{};  // called once, from the thread of the encoder, after the event of it

  /// "zero", "doctor"
  [[nodiscard]] std::string_view name() const;
  [[nodiscard]] bool changes_encoder() const { return kind == Kind::command && command->changes_encoder; }
};

/// `setting`: the command that reads one of them; "": all. Throws UsageError where the unit has none of it.
[[nodiscard]] Order settings_order(const Unit& unit, std::string_view setting);
/// `page` less than 0: what belongs to a copy of the memory. Throws also for more than can be read at once.
[[nodiscard]] Order memory_order(const Unit& unit, std::int64_t page);
[[nodiscard]] Order examination_order();

/// Of all but an examination. `between` is called between two requests of one that reads, and may read the position.
/// Throws what the encoder and its port throw.
[[nodiscard]] Done carry_out(client::Encoder& live, const Order& order, const std::function<void()>& between);

/// A list of {"field","value","meaning"} for people, without what belongs to the exchange; null: it does not hold.
[[nodiscard]] client::Json shown_values(const client::Answer& answer);

/// What of it can be read: {"settings":[names],"memory":[{"page","first","count","meaning","in_dump"}],"registers":n}
[[nodiscard]] client::Json readable_json(const Unit& unit);

}  // namespace absenc::serve
