// SPDX-License-Identifier: Apache-2.0
// Lists settings to try if hardly any reading is good: rates, SPI clocks, SPI modes, echo, models, options, addresses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absenc/client/doctor.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/client/port/address.hpp"

namespace absenc::client {

/// A setting to try instead of the user's, with the address that results.
struct Other {
  FindingKind finding_kind{};  // the finding if the setting helps
  std::string said{};          // the user's setting, "baud=115200"
  std::string setting{};       // the setting to try, "baud=9600"
  EncoderAddress address{};
};

/// Returns the other line settings to try: SPI modes and clocks on SPI, the other echo setting if the user set one, and
/// other rates if the port has a rate (`has_rate`).
[[nodiscard]] std::vector<Other> other_lines(const EncoderAddress& address, bool has_rate);

/// Returns up to 32 settings to try: other models, and on lines of characters other choices of an option, except of the
/// rate and the address. Leaves out those whose requests could change an encoder of another protocol on the line,
/// unless the user's own request could as well. Returns none on CAN, and for a virtual encoder, which always has the
/// given options.
[[nodiscard]] std::vector<Other> other_models(const EncoderAddress& address);

/// Returns each other address on the line as a setting to try, the lowest first. Leaves out addresses as `other_models`
/// does settings. Returns none if the unit has no addresses, if polling would disturb other devices, on CAN, for
/// encoders that send unsolicited, and for virtual encoders.
[[nodiscard]] std::vector<Other> other_addresses(const EncoderAddress& address);

/// Returns a search on the port of `address`, as `identify` runs it. Only for lines of characters.
[[nodiscard]] LineSearch search_of(const EncoderAddress& address);

/// Returns whether at least 80 % of the `tried` readings are good, and significantly more than of the readings with the
/// user's setting, of which `good_as_said` of `tried_as_said` are good (Fisher's exact test, 0.1 %).
[[nodiscard]] bool is_far_better(std::size_t good, std::size_t tried, std::size_t good_as_said,
                                 std::size_t tried_as_said);

}  // namespace absenc::client
