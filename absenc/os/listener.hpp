// SPDX-License-Identifier: Apache-2.0
// A TCP port that programs on this computer or others connect to.
#pragma once

#include <cstdint>
#include <string>

#include "absenc/os/descriptor.hpp"

struct sockaddr;

namespace absenc::os {

struct Listener {
  Descriptor socket;
  std::uint16_t port = 0;    // the one it got, when any was asked for
  bool on_loopback = false;  // nobody on another computer can reach it
};

/// `host`: a name, an IPv4 or an IPv6 address, that one also in brackets; `port` 0: any that is free. Throws Failure:
/// `not_found` (no such host here), `in_use`, `no_permission`, `system`.
[[nodiscard]] Listener listen_at(const std::string& host, std::uint16_t port);

/// "127.0.0.1"; "" of what is no internet address.
[[nodiscard]] std::string host_text(const sockaddr& address);

/// Whoever reads or writes there finds it at its end; it stays open until its owner closes it.
void end_connection(int socket);

}  // namespace absenc::os
