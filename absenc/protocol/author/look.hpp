// SPDX-License-Identifier: Apache-2.0
// Parts that procedures share: reading the position, and checking whether a zero may be set.
#pragma once

#include <cstdint>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/author/standstill.hpp"

namespace absenc::author {

/// Returns a reading whose position, or turns, are valid completely.
[[nodiscard]] constexpr Reading position_reading(std::uint64_t counts, unsigned bits) {
  Reading reading;
  reading.singleturn = counts & low_mask(bits);
  reading.singleturn_bits = reading.singleturn_valid_bits = bits;
  return reading;
}
/// Returns a reading that has turns and no position.
[[nodiscard]] constexpr Reading turns_reading(std::int64_t turns, Resolution resolution) {
  Reading reading;
  reading.multiturn = static_cast<std::uint64_t>(turns) & low_mask(resolution.multiturn_bits);
  reading.multiturn_bits = resolution.multiturn_bits;
  reading.multiturn_signed = resolution.multiturn_signed;
  reading.multiturn_valid = true;
  return reading;
}

/// Result of `look`: `Found` of procedures that report a position derives from it, or is it.
template <class P>
struct Looked {
  typename P::Request request{};  ///< The request.
  typename P::Reply reply{};      ///< The reply.
  Reading reading{};              ///< The position.
};

/// Requests the position once. `found` gets the reply with its times; the result is the position in counts.
template <class P>
Part<std::uint64_t> look(DialogOf<P>& dialog, Looked<P>& found, typename P::Request request) {
  found.reply = co_await dialog.ask(request);
  found.request = request;
  found.reading = dialog.last_reading();
  co_return found.reading.singleturn;
}

/// Reads the position twice. Ends the procedure if the zero must not be set, before anything is changed.
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
