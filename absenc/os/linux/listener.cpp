// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/listener.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <string>

#include "absenc/os/error.hpp"
#include "absenc/os/linux/addresses.hpp"

namespace absenc::os {

namespace {

Failure refusal(const std::string& host, std::uint16_t port, int error) {
  const std::string where = host + ":" + std::to_string(port);
  if (error == EADDRINUSE) {
    return {Failure::Kind::in_use, where + " is in use by another program: end it, or choose another port"};
  }
  if (error == EACCES) return {Failure::Kind::no_permission, "ports below 1024, as " + where + ", are for root"};
  if (error == EADDRNOTAVAIL) return {Failure::Kind::not_found, host + " is no address of this computer"};
  return system_failure("listening at " + where, error);
}

bool is_loopback(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    return ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) >> 24 == IN_LOOPBACKNET;
  }
  return address.sa_family == AF_INET6 &&
         IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
}

std::uint16_t port_of(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) < 0) {
    throw system_failure("getsockname", errno);
  }
  // The port number has the same offset in sockaddr_in and sockaddr_in6.
  return ntohs(reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

}  // namespace

Listener listen_at(const std::string& host, std::uint16_t port) {
  const Addresses found = look_up(host, port, SOCK_STREAM, AI_PASSIVE, "cannot listen at ");
  const addrinfo& one = *found;
  Listener listener;
  listener.socket = Descriptor(::socket(one.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int socket = listener.socket.get();
  const int on = 1;
  if (socket < 0 || ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) < 0 ||
      ::bind(socket, one.ai_addr, one.ai_addrlen) < 0 || ::listen(socket, SOMAXCONN) < 0) {
    throw refusal(host, port, errno);
  }
  listener.port = port_of(socket);
  listener.on_loopback = is_loopback(*one.ai_addr);
  return listener;
}

int release_socket(Descriptor& socket) { return socket.release(); }

std::string host_text(const sockaddr& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.sa_family == AF_INET) {
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in&>(address).sin_addr, text.data(), text.size());
  } else if (address.sa_family == AF_INET6) {
    ::inet_ntop(AF_INET6, &reinterpret_cast<const sockaddr_in6&>(address).sin6_addr, text.data(), text.size());
  }
  return text.data();
}

void end_connection(int socket) { ::shutdown(socket, SHUT_RDWR); }

}  // namespace absenc::os
