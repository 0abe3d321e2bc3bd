// SPDX-License-Identifier: Apache-2.0
// Procedure that finds the encoders on a line by a request to every address.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "absenc/core/hash.hpp"
#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// Result of `scan`: the addresses at which something answered, and those that two encoders may share.
template <std::size_t addresses>
struct Nodes {
  /// For each address: whether an encoder answered, with a valid reply or with two invalid ones.
  std::array<bool, addresses> there{};
  /// For each address: whether two requests got two invalid replies, and at least one of the replies was damaged. Two
  /// encoders share this address, or the line is bad.
  std::array<bool, addresses> clash{};
};

/// Value of `request_to_all` in `scan` for protocols in which no address reaches every encoder.
struct NoneReachesAll {};

/// Sends the request `request_to(i)` to each address i, and stores in `nodes` which addresses answered. An address that
/// is not silent is requested twice, because one answer may be noise. Errors: timeout (no answer at any address, or
/// none to `request_to_all`), wrong_length (eight addresses in a row answered with damaged replies, or all addresses of
/// the range with the same reply, so the device is no encoder), or that of a line that is never silent. With
/// `request_to_all`, a request that every encoder answers, the addresses are only asked if it is answered.
template <class P, std::size_t addresses, auto request_to, auto request_to_all = NoneReachesAll{}>
Procedure scan(DialogOf<P>& dialog, Nodes<addresses>& nodes) {
  constexpr unsigned most_damaged_in_a_row = 8;
  if constexpr (!std::is_same_v<std::remove_const_t<decltype(request_to_all)>, NoneReachesAll>) {
    constexpr unsigned tries = 3;
    for (unsigned i = 0;; ++i) {
      if (i == tries) co_return {Error::timeout, "the address of all encoders was not answered at this rate"};
      const Result<typename P::Reply> any = co_await dialog.attempt(request_to_all()).once();
      if (dialog.is_noisy()) co_return {any.error()};
      if (any || any.error() != Error::timeout) break;
    }
  }
  bool any = false;
  unsigned damaged_in_a_row = 0;
  std::size_t same = 0;  // number of addresses whose good reply has the same bytes as that of the first address
  std::uint32_t first_hash = 0;
  for (std::size_t i = 0; i < addresses; ++i) {
    const Result<typename P::Reply> first = co_await dialog.attempt(request_to(i)).once();
    if (dialog.is_noisy()) co_return {first.error()};
    const std::uint32_t hash = fnv1a(dialog.exchange().received);
    if (i == 0) first_hash = hash;
    same += first && hash == first_hash ? 1 : 0;
    if (!first && first.error() == Error::timeout) {
      damaged_in_a_row = 0;
      continue;
    }
    const Result<typename P::Reply> second = co_await dialog.attempt(request_to(i)).once();
    if (!first && !second && second.error() == Error::timeout) {
      damaged_in_a_row = 0;
      continue;
    }
    nodes.there[i] = any = true;
    // One encoder alone sends two complete but invalid replies, so they are no sign of two encoders at one address.
    nodes.clash[i] = !first && !second && (is_damage(first.error()) || is_damage(second.error()));
    // Only damage shows noise: eight encoders with consecutive addresses all send good replies.
    const bool is_damaged = (!first && is_damage(first.error())) || (!second && is_damage(second.error()));
    damaged_in_a_row = is_damaged ? damaged_in_a_row + 1 : 0;
    if (damaged_in_a_row == most_damaged_in_a_row) {
      co_return {Error::wrong_length, "something comes back whatever address is asked: noise, or another device"};
    }
  }
  if (same == addresses) {
    co_return {Error::wrong_length, "every address gets the same reply: a device that ignores the address",
               "disconnect it, or read it with the address that it should have"};
  }
  if (!any) co_return {Error::timeout, "no address was answered at this rate"};
  co_return done;
}

}  // namespace absenc::author
