// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/linux/addresses.hpp"

#include "absenc/os/error.hpp"

namespace absenc::os {

Addresses look_up(const std::string& host, std::uint16_t port, int socket_type, int flags, const std::string& before,
                  const std::string& behind) {
  const bool in_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  const std::string plain = in_brackets ? host.substr(1, host.size() - 2) : host;
  addrinfo wanted{};
  wanted.ai_flags = flags | AI_NUMERICSERV;
  wanted.ai_socktype = socket_type;
  addrinfo* found = nullptr;
  const int error = ::getaddrinfo(plain.c_str(), std::to_string(port).c_str(), &wanted, &found);
  if (error != 0) {
    throw Failure(Failure::Kind::not_found,
                  before + plain + behind + " (" + ::gai_strerror(error) + "): check the name and the network");
  }
  return {found, &::freeaddrinfo};
}

}  // namespace absenc::os
