// SPDX-License-Identifier: Apache-2.0
// What captured frames say of an option: each of its values is judged by the first frame that contradicts it.
#pragma once

#include <optional>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::raa38 {

/// Tells every value from `first` to `last`. `against(value, i)` is why capture i contradicts it; empty: it does not.
/// Whether one is possible, which `value` then is: as it was, if that is, because the position of a shaft that was not
/// turned has as many bits as it likes.
template <class Against>
bool judge(EvidenceSink& sink, std::size_t option, std::int64_t first, std::int64_t last, std::size_t captures,
           std::int64_t& value, std::string_view agrees, Against&& against) {
  std::optional<std::int64_t> chosen;
  for (std::int64_t one = first; one <= last; ++one) {
    std::string_view why;
    std::size_t i = 0;
    while (i < captures && (why = against(one, i)).empty()) ++i;
    sink.put({option, one, why.empty(), why.empty() ? 0 : i, why.empty() ? agrees : why});
    if (why.empty() && (!chosen || one == value)) chosen = one;
  }
  if (chosen) value = *chosen;
  return chosen.has_value();
}

}  // namespace absenc::raa38
