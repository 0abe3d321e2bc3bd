// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/listener.hpp"

#include <array>

#include "absenc/os/error.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/sockets.hpp"

namespace absenc::os {

namespace {

Failure refusal(const std::string& host, std::uint16_t port, DWORD error) {
  const std::string where = host + ":" + std::to_string(port);
  if (error == WSAEADDRINUSE || error == WSAEACCES) {  // WSAEACCES: the port is reserved or used exclusively
    return {Failure::Kind::in_use, where + " is in use by another program: end it, or choose another port"};
  }
  if (error == WSAEADDRNOTAVAIL) return {Failure::Kind::not_found, host + " is no address of this computer"};
  return windows_failure("listening at " + where, error);
}

bool is_loopback(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    return ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) >> 24 == 127;
  }
  return address.sa_family == AF_INET6 &&
         IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
}

std::uint16_t port_of(SOCKET socket) {
  sockaddr_storage address{};
  int size = sizeof address;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw windows_failure("getsockname", static_cast<DWORD>(::WSAGetLastError()));
  }
  // The port number has the same offset in sockaddr_in and sockaddr_in6.
  return ntohs(reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

}  // namespace

Listener listen_at(const std::string& host, std::uint16_t port) {
  const Addresses found = look_up(host, port, SOCK_STREAM, AI_PASSIVE);
  const addrinfo& one = *found;
  Socket socket(one.ai_family);
  const BOOL on = TRUE;  // without it another program could listen on the same port and take our clients
  unsigned long does_not_block = 1;
  if (!socket ||
      ::setsockopt(socket.get(), SOL_SOCKET, SO_EXCLUSIVEADDRUSE, reinterpret_cast<const char*>(&on), sizeof on) != 0 ||
      ::ioctlsocket(socket.get(), static_cast<long>(FIONBIO), &does_not_block) != 0 ||
      ::bind(socket.get(), one.ai_addr, static_cast<int>(one.ai_addrlen)) != 0 ||
      ::listen(socket.get(), SOMAXCONN) != 0) {
    throw refusal(host, port, static_cast<DWORD>(::WSAGetLastError()));
  }
  Listener listener;
  listener.port = port_of(socket.get());
  listener.on_loopback = is_loopback(*one.ai_addr);
  listener.socket = descriptor_of(std::make_unique<HeldSocket>(std::move(socket)));
  return listener;
}

int release_socket(Descriptor& socket) {
  const SOCKET released = dynamic_cast<HeldSocket&>(*waitable_of(socket.get())).socket.release();
  socket = Descriptor();
  return static_cast<int>(released);  // handles have 32 bits that matter, also in 64-bit programs
}

std::string host_text(const sockaddr& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.sa_family == AF_INET) {
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in&>(address).sin_addr, text.data(), text.size());
  } else if (address.sa_family == AF_INET6) {
    ::inet_ntop(AF_INET6, &reinterpret_cast<const sockaddr_in6&>(address).sin6_addr, text.data(), text.size());
  }
  return text.data();
}

void end_connection(int socket) { ::shutdown(static_cast<SOCKET>(socket), SD_BOTH); }

}  // namespace absenc::os
