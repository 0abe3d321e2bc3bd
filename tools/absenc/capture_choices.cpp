// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/capture_choices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace absenc::tool {

namespace {

constexpr std::array<std::string_view, 3> parities{"none", "odd", "even"};
constexpr std::array<Parity, 3> parity_values{Parity::none, Parity::odd, Parity::even};

Parity parse_parity(std::string_view text) {
  const auto found = std::find(parities.begin(), parities.end(), text);
  if (found == parities.end()) throw UsageError(fmt::format("--parity {}: it is none, odd or even", text));
  return parity_values[static_cast<std::size_t>(found - parities.begin())];
}

}  // namespace

CaptureChoices capture_choices(const Invocation& invocation, std::string_view path) {
  constexpr std::int64_t fastest = 1'000'000'000'000;
  CaptureChoices choices;
  choices.path = path;
  choices.how.channels.assign(invocation.texts("--channel").begin(), invocation.texts("--channel").end());
  choices.how.raw_channels = static_cast<unsigned>(invocation.number("--raw-channels", 0, 1, 64));
  choices.how.samples_per_second = static_cast<std::uint64_t>(invocation.number("--rate", 0, 1, fastest));
  choices.how.baud = invocation.real("--baud", 0, 1, 1e9);
  if (invocation.has("--parity")) choices.how.parity = parse_parity(invocation.text("--parity"));
  if (choices.how.raw_channels != 0 && choices.how.samples_per_second == 0) {
    throw UsageError("raw samples have no rate: give the samples a second with --rate");
  }
  return choices;
}

}  // namespace absenc::tool
