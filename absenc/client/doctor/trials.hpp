// SPDX-License-Identifier: Apache-2.0
// Settings that may be the right ones where no reading is good: rates, SPI modes, echo, models, addresses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absenc/client/doctor.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/client/port/address.hpp"

namespace absenc::client {

/// A setting to try in place of the user's.
struct Other {
  Ailment ailment{};      // what it is when this one helps
  std::string said{};     // "baud=115200"
  std::string setting{};  // "baud=9600"
  EncoderAddress address{};
};

/// SPI modes and clocks, echo, and where the port `has_rate` other rates.
[[nodiscard]] std::vector<Other> other_lines(const EncoderAddress& address, bool has_rate);

/// Each other model, and on lines of characters each other choice of an option. None of their requests is one by which
/// another encoder on the line would be changed. None of a virtual encoder, which is whatever it is said to be.
[[nodiscard]] std::vector<Other> other_models(const EncoderAddress& address);

/// Each other address of the encoder on its line, the lowest first; none where asking others disturbs them.
[[nodiscard]] std::vector<Other> other_addresses(const EncoderAddress& address);

/// Returns where `identify` is to look for encoders of other protocols. Only of lines of characters.
[[nodiscard]] LineSearch search_of(const EncoderAddress& address);

/// Whether `good` of `tried` is more than `good_as_said` of `tried_as_said` by far more than chance (Fisher's exact
/// test), and nearly all.
[[nodiscard]] bool is_far_better(std::size_t good, std::size_t tried, std::size_t good_as_said,
                                 std::size_t tried_as_said);

}  // namespace absenc::client
