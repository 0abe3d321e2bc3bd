// SPDX-License-Identifier: Apache-2.0
// Network functions for sending by MQTT and UDP: names of computers, waiting for a socket, UDP to one address.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

/// A sender of UDP datagrams to one address. Sending never blocks.
class Datagrams {
 public:
  /// Resolves `host`, a name or an address, to the address of all datagrams. Throws Failure: `not_found`, `system`.
  Datagrams(const std::string& host, std::uint16_t port);

  /// Sends `text` as one datagram. Returns false if the system did not take it.
  [[nodiscard]] bool send(std::string_view text);

 private:
  Descriptor socket_;
};

/// A socket of a library, which `wait_for` can watch. The library keeps the socket and closes it.
class LibrarySocket {
 public:
  /// Watches `socket` from now on; -1: none.
  void watch(int socket);
  /// Returns the descriptor of the watched socket; -1: none.
  [[nodiscard]] int descriptor() const;

 private:
  int socket_ = -1;
  Descriptor event_;  // only Windows has one
};

/// Returns the text of `error`, which a library that uses sockets leaves in errno.
[[nodiscard]] std::string socket_error_text(int error);

/// Returns the addresses of the name `host` as text. Throws Failure `not_found`.
[[nodiscard]] std::vector<std::string> addresses_of(const std::string& host);

/// Waits at most `longest` until `socket`, or a channel, can be read; with `for_writing` until it can be read or
/// written. Ctrl-C does not end it.
[[nodiscard]] Ready wait_for_socket(int socket, bool for_writing, Time longest);

/// Returns the name of this computer; "" if it has none.
[[nodiscard]] std::string host_name();

}  // namespace absenc::os
