// SPDX-License-Identifier: Apache-2.0
// Lists settings to try if hardly any reading is good.
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
  FindingKind finding_kind{};  // kind of the finding that is reported if readings succeed with the setting
  std::string said{};          // the user's setting, "baud=115200"
  std::string setting{};       // the setting to try, "baud=9600"
  EncoderAddress address{};
};

/// Returns other settings of port and line; other rates only if the port has a rate (`has_rate`).
[[nodiscard]] std::vector<Other> other_lines(const EncoderAddress& address, bool has_rate);

[[nodiscard]] std::vector<Other> other_models(const EncoderAddress& address);

[[nodiscard]] std::vector<Other> other_addresses(const EncoderAddress& address);

/// Returns a search for encoders on the port of the address, with the user's settings of latency and RS-485.
[[nodiscard]] LineSearch search_of(const EncoderAddress& address);

/// Returns whether at least 8 of 10 readings with a tried setting are good, and so many more than with the user's
/// setting that the probability of this by chance is below 1/1000 (Fisher's exact test).
[[nodiscard]] bool is_far_better(std::size_t good, std::size_t tried, std::size_t good_as_said,
                                 std::size_t tried_as_said);

}  // namespace absenc::client
