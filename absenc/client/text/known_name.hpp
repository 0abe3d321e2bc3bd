// SPDX-License-Identifier: Apache-2.0
// Finds protocols by the names of makers, families and models.
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

  /// Returns "AksIM-2 is a model of encolink and encolink-spi" or "RLS: the protocols are encolink, e201 and biss".
  [[nodiscard]] std::string sentence() const;
};

/// Returns the known name that equals `written` without regard to case, '-' and spaces; nothing if there is none, also
/// for the name of a protocol.
[[nodiscard]] std::optional<KnownName> find_known_name(std::string_view word);

}  // namespace absenc::client
