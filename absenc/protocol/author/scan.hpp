// SPDX-License-Identifier: Apache-2.0
// Who answers on a line: every address is asked.
#pragma once

#include <array>
#include <cstddef>

#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// Addresses at which an encoder answered.
template <std::size_t addresses>
struct Nodes {
  std::array<bool, addresses> there{};  ///< Whether an encoder answered, for each address.
  std::array<bool, addresses> clash{};  ///< every answer was damaged: two encoders of one address, or a bad line
};

/// `request_to(i)` asks the address of this index. Each that is not silent is asked twice: one answer may be noise.
/// What answers at every address is no encoder.
template <class P, std::size_t addresses, auto request_to>
Procedure scan(DialogOf<P>& dialog, Nodes<addresses>& nodes) {
  constexpr unsigned most_in_a_row = 8;
  bool any = false;
  unsigned noise = 0;
  for (std::size_t i = 0; i < addresses; ++i) {
    const Result<typename P::Reply> first = co_await dialog.attempt(request_to(i)).once();
    if (dialog.is_noisy()) co_return {first.error()};
    if (!first && first.error() == Error::timeout) {
      noise = 0;
      continue;
    }
    const Result<typename P::Reply> second = co_await dialog.attempt(request_to(i)).once();
    if (!first && !second && second.error() == Error::timeout) continue;
    nodes.there[i] = any = true;
    // Two whole answers that are not good are those of one encoder.
    nodes.clash[i] = !first && !second && (is_damage(first.error()) || is_damage(second.error()));
    if (++noise == most_in_a_row) {
      co_return {Error::wrong_length, "something comes back whatever address is asked: noise, or another device"};
    }
  }
  if (!any) co_return {Error::timeout, "no address was answered at this rate"};
  co_return done;
}

}  // namespace absenc::author
