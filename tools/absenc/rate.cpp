// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/rate.hpp"

#include <fmt/format.h>

#include "tools/absenc/error.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

double readings_a_second(const Invocation& invocation, double fallback) {
  constexpr double one_a_day = 1.0 / 86'400;
  const double rate = invocation.real("--rate", fallback, 0, 1e6);
  if (rate == 0) return rate;
  if (rate < one_a_day) {
    throw UsageError(
        fmt::format("--rate is {}, one reading in {:.3g} days: too few to mean anything. Give one a day ({:.3g}) at "
                    "least, or 0 for as many as the line allows",
                    invocation.text("--rate"), one_a_day / rate, one_a_day));
  }
  if (invocation.has("--for") && invocation.real("--for", 0, 0.001, 1e9) * rate <= 1) {
    print_message(fmt::format("note: at --rate {} a reading comes every {:.4g} s, so --for {} ends after the first",
                              rate, 1 / rate, invocation.text("--for")));
  }
  return rate;
}

std::vector<std::string> reading_settings(const Invocation& invocation) {
  const auto options = invocation.texts("--option");
  std::vector<std::string> settings(options.begin(), options.end());
  if (invocation.has("--command")) settings.push_back(fmt::format("command={}", invocation.text("--command")));
  if (invocation.has("--realtime")) settings.push_back(fmt::format("realtime={}", invocation.text("--realtime")));
  return settings;
}

}  // namespace absenc::tool
