// SPDX-License-Identifier: Apache-2.0
// Resolution of host names to network addresses.
#pragma once

#include <netdb.h>

#include <cstdint>
#include <memory>
#include <string>

namespace absenc::os {

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

/// Returns the addresses of `host`: a name or an address, an IPv6 address also in brackets. `socket_type` is for
/// example SOCK_STREAM, `flags` for example AI_PASSIVE. If the look-up fails, throws Failure `not_found` with a text
/// that begins with `before` + `host` without brackets + `behind`; `before` and `behind` are for example "the host "
/// and " is not known".
[[nodiscard]] Addresses look_up(const std::string& host, std::uint16_t port, int socket_type, int flags,
                                const std::string& before, const std::string& behind = {});

}  // namespace absenc::os
