// SPDX-License-Identifier: Apache-2.0
// Finds protocols by the names of encoder makers, families and models.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Name of a maker, a family or a model, with the protocols of its encoders.
struct KnownName {
  std::string_view name;
  bool is_model = false;
  std::vector<const Unit*> units;

  /// Returns a sentence about the name, as "AksIM-2 is a model of encolink and encolink-spi".
  [[nodiscard]] std::string sentence() const;
};

/// Finds a maker, a family or a model by the letters and digits of its name, in any case; nothing: there is none, or
/// `word` is a protocol.
[[nodiscard]] std::optional<KnownName> find_known_name(std::string_view word);

}  // namespace absenc::client
