// SPDX-License-Identifier: Apache-2.0
// Resolution of host names to network addresses.
#pragma once

#include <netdb.h>

#include <cstdint>
#include <memory>
#include <string>

namespace absenc::os {

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

/// Returns the addresses of `host`: a name or an address, also in brackets. Throws Failure `not_found`, whose text
/// begins with `before`, the host and `behind`.
[[nodiscard]] Addresses look_up(const std::string& host, std::uint16_t port, int socket_type, int flags,
                                const std::string& before, const std::string& behind = {});

}  // namespace absenc::os
