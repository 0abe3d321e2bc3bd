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

/// Returns the addresses of the name `host` as text. Throws Failure `not_found`.
[[nodiscard]] std::vector<std::string> addresses_of(const std::string& host);

/// Waits at most `longest` until `socket` can be read; with `for_writing` until it can be read or written.
[[nodiscard]] Ready wait_for_socket(int socket, bool for_writing, Time longest);

/// Returns the name of this computer; "" if it has none.
[[nodiscard]] std::string host_name();

}  // namespace absenc::os
