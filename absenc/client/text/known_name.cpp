// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/known_name.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <span>

#include "absenc/protocol/all.hpp"

namespace absenc::client {

namespace {

// Returns the letters, in lower case, and the digits of a name, so that names can be compared.
std::string letters_and_digits(std::string_view name) {
  std::string text;
  for (const unsigned char c : name) {
    if (std::isalnum(c) != 0) text += static_cast<char>(std::tolower(c));
  }
  return text;
}

}  // namespace

std::string KnownName::sentence() const {
  std::vector<std::string_view> ids;
  for (const Unit* unit : units) ids.push_back(unit->id);
  const std::span<const std::string_view> all(ids);
  const std::string protocols = ids.size() == 1
                                    ? std::string(ids.front())
                                    : fmt::format("{} and {}", fmt::join(all.first(all.size() - 1), ", "), all.back());
  if (is_model) return fmt::format("{} is a model of {}", name, protocols);
  return fmt::format("{}: the protocol{} {}", name, ids.size() == 1 ? " is" : "s are", protocols);
}

std::optional<KnownName> find_known_name(std::string_view word) {
  const std::string wanted = letters_and_digits(word);
  if (wanted.empty() || find_unit(word) != nullptr) return std::nullopt;
  KnownName known;
  for (const Unit* unit : all_units()) {
    std::string_view found;
    for (const std::string_view name : unit->known_as) {
      if (letters_and_digits(name) == wanted) found = name;
    }
    for (const Model& model : unit->models) {
      if (letters_and_digits(model.name) != wanted) continue;
      found = model.name;
      known.is_model = true;
    }
    if (found.empty()) continue;
    known.name = found;
    known.units.push_back(unit);
  }
  return known.units.empty() ? std::nullopt : std::optional(known);
}

}  // namespace absenc::client
