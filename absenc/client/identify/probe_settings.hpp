// SPDX-License-Identifier: Apache-2.0
// Selects the units that may be on a line, the options to try for each unit, and the requests that could change another
// unit.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/identify/line.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

using SettingTexts = std::vector<std::string>;  // settings, each as "address=3"

enum class Medium : std::uint8_t { serial, tcp, spi, ftdi, can };

/// Returns the kind of port that is searched.
[[nodiscard]] Medium medium_of(const LineSearch& search);

/// Returns whether an encoder of this unit can be connected to the port that is searched.
[[nodiscard]] bool fits(const Unit& unit, const LineSearch& search);

/// Returns whether an encoder of this unit may receive requests at `rate`, in bits per second.
[[nodiscard]] bool can_receive(const Unit& unit, std::uint32_t rate, const LineSearch& search);

[[nodiscard]] bool has_setting(const SettingTexts& settings, std::string_view name);

/// Returns those of `settings` that set options of the unit; with `with_model` also the setting of the model.
[[nodiscard]] std::vector<OptionText> option_settings(const Unit& unit, const SettingTexts& settings, bool with_model);

/// Returns the request of the command with default arguments; empty if the command has no request that can be encoded.
[[nodiscard]] std::vector<std::uint8_t> request_of(const Unit& unit, const Options& options, const Command& command);

/// Returns the sets of settings to try in addition to `settings`, at most 8: the empty set, and a set for each model or
/// choice of an option that changes the request. On clocked lines, where the request is the same for all models,
/// returns the empty set and a set for each model. Leaves out settings with which the encoder sends unsolicited frames.
[[nodiscard]] std::vector<SettingTexts> settings_to_try(const Unit& unit, const SettingTexts& settings,
                                                        const Command& read);

/// Returns requests, with default options and arguments, that would change an encoder of another unit that may be on
/// the line at `rate`. Requests of `unit` must not begin with one of them.
[[nodiscard]] std::vector<std::vector<std::uint8_t>> harmful_to_others(const Unit& unit, std::uint32_t rate,
                                                                       const LineSearch& search);

}  // namespace absenc::client
