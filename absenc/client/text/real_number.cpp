// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/real_number.hpp"

#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <string>

namespace absenc::client {

std::optional<double> parse_real(std::string_view text) {
  const std::string copy(text);
  if (copy.empty() || std::isspace(static_cast<unsigned char>(copy.front())) != 0) return std::nullopt;
  char* end = nullptr;
  errno = 0;
  const double value = std::strtod(copy.c_str(), &end);
  const bool is_number = end == copy.c_str() + copy.size() && std::isfinite(value) && errno != ERANGE;
  return is_number ? std::optional(value) : std::nullopt;
}

}  // namespace absenc::client
