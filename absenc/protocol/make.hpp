// SPDX-License-Identifier: Apache-2.0
// Constructs a unit's machines (conversations and virtual encoders) in storage of the caller.
#pragma once

#include <cstddef>
#include <new>
#include <span>
#include <type_traits>

#include "absenc/protocol/unit.hpp"

namespace absenc {

namespace detail {
template <class Machine, class... Parameters>
Machine* make_in(std::span<std::byte> storage, const Parameters&... parameters) {
  return storage.size() < sizeof(Machine) ? nullptr : new (storage.data()) Machine(parameters...);
}

template <template <class> class Role, class Made>
Any<Role> any_of(Made* machine) {
  if constexpr (std::is_base_of_v<Machine<CanFrame>, Made>) {
    return {.frames = machine};
  } else {
    return {.bytes = machine};
  }
}
}  // namespace detail

/// Constructs a conversation in `storage`; returns an empty Any if that is too small.
template <class Machine, class... Parameters>
[[nodiscard]] Any<Conversation> make_host(std::span<std::byte> storage, const Parameters&... parameters) {
  return detail::any_of<Conversation>(detail::make_in<Machine>(storage, parameters...));
}

/// Constructs a virtual encoder in `storage`; returns an empty Any if that is too small.
template <class Machine, class... Parameters>
[[nodiscard]] Any<Device> make_device(std::span<std::byte> storage, const Parameters&... parameters) {
  return detail::any_of<Device>(detail::make_in<Machine>(storage, parameters...));
}

}  // namespace absenc
