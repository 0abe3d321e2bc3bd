// SPDX-License-Identifier: Apache-2.0
// Names that people know instead of that of a protocol: of makers, families and models.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// A maker, a family or a model, and the protocols of its encoders.
struct KnownName {
  std::string_view name;
  bool is_model = false;
  std::vector<const Unit*> units;

  /// "AksIM-2 is a model of encolink and encolink-spi", "RLS: the protocols are encolink, e201 and biss"
  [[nodiscard]] std::string sentence() const;
};

/// Upper and lower case, '-' and spaces make no difference. Empty for a word that is none, also for a protocol.
[[nodiscard]] std::optional<KnownName> find_known_name(std::string_view word);

}  // namespace absenc::client
