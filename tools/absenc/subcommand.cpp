// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/subcommand.hpp"

#include <fmt/format.h>

#include <optional>

#include "absenc/client/text/real_number.hpp"
#include "absenc/protocol/options.hpp"
#include "tools/absenc/error.hpp"

namespace absenc::tool {

std::string_view first_word(const Subcommand& subcommand) {
  const std::size_t space = subcommand.name.find(' ');
  return space == std::string_view::npos ? std::string_view() : subcommand.name.substr(0, space);
}

std::string_view last_word(const Subcommand& subcommand) {
  // In a name without a blank `find` returns npos, and npos + 1 is 0, so the whole name is returned.
  return subcommand.name.substr(subcommand.name.find(' ') + 1);
}

std::string_view Invocation::text(std::string_view name, std::string_view fallback) const {
  const auto found = values_.find(name);
  return found == values_.end() ? fallback : std::string_view(found->second.back());
}

std::span<const std::string> Invocation::texts(std::string_view name) const {
  const auto found = values_.find(name);
  if (found == values_.end()) return {};
  return found->second;
}

std::int64_t Invocation::number(std::string_view name, std::int64_t fallback, std::int64_t minimum,
                                std::int64_t maximum) const {
  if (!has(name)) return fallback;
  const Result<std::int64_t> number = parse_number(text(name));
  if (number && *number >= minimum && *number <= maximum) return *number;
  const std::string range =
      maximum == INT64_MAX ? fmt::format("{} or more", minimum) : fmt::format("from {} to {}", minimum, maximum);
  throw UsageError(fmt::format("{} is \"{}\", but must be a whole number, {}", name, text(name), range));
}

double Invocation::real(std::string_view name, double fallback, double minimum, double maximum) const {
  if (!has(name)) return fallback;
  const std::optional<double> value = parse_real(text(name));
  if (value && *value >= minimum && *value <= maximum) return *value;
  throw UsageError(fmt::format("{} is \"{}\", but must be a number from {} to {}", name, text(name), minimum, maximum));
}

}  // namespace absenc::tool
