// SPDX-License-Identifier: Apache-2.0
// A TCP port that listens for connections from this or other computers.
#pragma once

#include <cstdint>
#include <string>

#include "absenc/os/descriptor.hpp"

struct sockaddr;

namespace absenc::os {

struct Listener {
  Descriptor socket;
  std::uint16_t port = 0;    // actual number of the TCP port, also when any free port was requested
  bool on_loopback = false;  // whether only programs on this computer can reach the port
};

/// Opens a TCP port at `host`: a name or an address, an IPv6 address also in brackets. `port` 0: any free one. Throws
/// Failure.
[[nodiscard]] Listener listen_at(const std::string& host, std::uint16_t port);

/// Gives up ownership of the socket of a Listener, and returns its number for libraries, one of which must close it.
[[nodiscard]] int release_socket(Descriptor& socket);

/// Returns the IP address in `address` as text, "127.0.0.1"; "" if it is no internet address.
[[nodiscard]] std::string host_text(const sockaddr& address);

/// Shuts down the connection of `socket`, a number of a library, which stays open until its owner closes it.
void end_connection(int socket);

}  // namespace absenc::os
