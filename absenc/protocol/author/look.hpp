// SPDX-License-Identifier: Apache-2.0
// Parts of procedures: reading the position, and checking whether a zero may be set.
#pragma once

#include <cstdint>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/author/standstill.hpp"

namespace absenc::author {

/// Returns a reading that has only a single-turn position of `bits` bits, all valid, and no turns.
[[nodiscard]] constexpr Reading position_reading(std::uint64_t counts, unsigned bits) {
  Reading reading;
  reading.singleturn = counts & low_mask(bits);
  reading.singleturn_bits = reading.singleturn_valid_bits = bits;
  return reading;
}
/// Returns a reading that has only turns, all valid, and no position.
[[nodiscard]] constexpr Reading turns_reading(std::int64_t turns, Resolution resolution) {
  Reading reading;
  reading.multiturn = static_cast<std::uint64_t>(turns) & low_mask(resolution.multiturn_bits);
  reading.multiturn_bits = resolution.multiturn_bits;
  reading.multiturn_signed = resolution.multiturn_signed;
  reading.multiturn_valid = true;
  return reading;
}

/// The last exchange that `look` stored.
template <class P>
struct Looked {
  typename P::Request request{};  ///< The request for the position that was sent.
  typename P::Reply reply{};      ///< The valid reply to the request.
  Reading reading{};              ///< The reading of the reply, with the times of the exchange.
};

/// Requests the position, stores the exchange in `found`, and returns the position in counts. Without a valid reply the
/// procedure ends.
template <class P>
Part<std::uint64_t> look(DialogOf<P>& dialog, Looked<P>& found, typename P::Request request) {
  found.reply = co_await dialog.ask(request);
  found.request = request;
  found.reading = dialog.last_reading();
  co_return found.reading.singleturn;
}

/// Reads the position twice, and ends the procedure if a zero must not be set now.
template <class P>
Part<bool> may_set_zero(DialogOf<P>& dialog, Looked<P>& found, typename P::Request request) {
  co_await look(dialog, found, request);
  const Reading first = found.reading;
  co_await dialog.rest(between_looks);
  co_await look(dialog, found, request);
  const Outcome why_not = objection_to_zero(first, found.reading);
  if (why_not.error != Error::none) co_await dialog.stop(why_not);
  co_return true;
}

}  // namespace absenc::author
