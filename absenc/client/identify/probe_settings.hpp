// SPDX-License-Identifier: Apache-2.0
// Selects the units that may be on a line, the ways to ask each of them, and the requests that could harm another one.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/identify/line.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

using Settings = std::vector<std::string>;  // "address=3"

enum class Medium : std::uint8_t { serial, tcp, spi, can };

/// Returns the kind of port at the place that is searched.
[[nodiscard]] Medium medium_of(const LineSearch& search);

/// Whether an encoder of this unit can be at such a port.
[[nodiscard]] bool fits(const Unit& unit, const LineSearch& search);

/// Whether an encoder of this unit may receive what is sent at `rate`, bits a second.
[[nodiscard]] bool can_receive(const Unit& unit, std::uint32_t rate, const LineSearch& search);

[[nodiscard]] bool has_setting(const Settings& settings, std::string_view name);

/// Returns the settings that are options of the unit.
[[nodiscard]] std::vector<OptionText> option_settings(const Unit& unit, const Settings& settings, bool with_model);

/// Returns the request of a command with its usual arguments; empty where it has none.
[[nodiscard]] std::vector<std::uint8_t> request_of(const Unit& unit, const Options& options, const Command& command);

/// Returns the settings to add to `settings` in each way in which the unit may have to be asked, at most 8: none, each
/// model, and single choices that change the request. On clocked links the request is the same for all models, which
/// differ in their number of bits. Ways in which the encoder sends by itself are left out.
[[nodiscard]] std::vector<Settings> settings_to_try(const Unit& unit, const Settings& settings, const Command& read);

/// Returns the requests by which encoders of other units that may receive them would be changed.
[[nodiscard]] std::vector<std::vector<std::uint8_t>> harmful_to_others(const Unit& unit, std::uint32_t rate,
                                                                       const LineSearch& search);

}  // namespace absenc::client
