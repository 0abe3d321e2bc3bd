// SPDX-License-Identifier: Apache-2.0
// What the system makes of the name of a host.
#pragma once

#include <netdb.h>

#include <cstdint>
#include <memory>
#include <string>

namespace absenc::os {

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

/// `host`: a name or an address, an IPv6 one also in brackets; `socket_type` as SOCK_STREAM, `flags` as AI_PASSIVE.
/// Throws Failure, `not_found`, in words of the caller before the host and behind it: "the host ", " is not known".
[[nodiscard]] Addresses look_up(const std::string& host, std::uint16_t port, int socket_type, int flags,
                                const std::string& before, const std::string& behind = {});

}  // namespace absenc::os
