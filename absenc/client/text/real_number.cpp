// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/real_number.hpp"

#include <charconv>
#include <cmath>

namespace absenc::client {

// std::strtod would take the decimal point from the program's locale.
std::optional<double> parse_real(std::string_view text) {
  if (text.starts_with("+-")) return std::nullopt;
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
  return is_number ? std::optional(value) : std::nullopt;
}

}  // namespace absenc::client
