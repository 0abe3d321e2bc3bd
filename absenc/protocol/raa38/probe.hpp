// SPDX-License-Identifier: Apache-2.0
// Judges which values of an option fit captured frames.
#pragma once

#include <optional>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::raa38 {

/// Puts each value of an option from `first` to `last` with its evidence into `sink`. `contradiction(value, i)` returns
/// why capture i contradicts the value, or an empty text. If the present `value` is contradicted, sets it to the first
/// value that is not; returns false if all are contradicted.
template <class Contradiction>
bool judge_option(EvidenceSink& sink, std::size_t option, std::int64_t first, std::int64_t last, std::size_t captures,
                  std::int64_t& value, std::string_view agrees, Contradiction&& contradiction) {
  std::optional<std::int64_t> chosen;
  for (std::int64_t one = first; one <= last; ++one) {
    std::string_view why;
    std::size_t i = 0;
    while (i < captures && (why = contradiction(one, i)).empty()) ++i;
    sink.put({option, one, why.empty(), why.empty() ? 0 : i, why.empty() ? agrees : why});
    if (why.empty() && (!chosen || one == value)) chosen = one;
  }
  if (chosen) value = *chosen;
  return chosen.has_value();
}

}  // namespace absenc::raa38
