// SPDX-License-Identifier: Apache-2.0
// What sends over a network: names of computers, waiting for a socket, UDP to one place.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// To one place, which is told and never waited for.
class Datagrams {
 public:
  /// `host`: a name, which is looked up now, or an address. Throws Failure: `not_found`, `system`.
  Datagrams(const std::string& host, std::uint16_t port);

  /// False when there was no room for it, or nobody is there: it is lost.
  [[nodiscard]] bool send(std::string_view text);

 private:
  Descriptor socket_;
};

/// The addresses of a computer, as text, in the order in which they are to be tried; looked up now. Throws Failure:
/// `not_found`.
[[nodiscard]] std::vector<std::string> addresses_of(const std::string& host);

/// What a socket of somebody else's library is ready for.
struct Ready {
  bool to_read = false;
  bool to_write = false;
};
/// Waits at most this long, or until a signal comes. Any number of open descriptors is good, as select() has it not.
[[nodiscard]] Ready wait_for_socket(int socket, bool for_writing, Time longest);

/// Of this computer; "" when it has none.
[[nodiscard]] std::string host_name();

}  // namespace absenc::os
