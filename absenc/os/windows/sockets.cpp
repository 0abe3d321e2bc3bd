// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/windows/sockets.hpp"

#include "absenc/os/windows/errors.hpp"

namespace absenc::os {

namespace {

void start_winsock() {
  static const int error = [] {
    WSADATA data{};
    return ::WSAStartup(MAKEWORD(2, 2), &data);
  }();
  if (error != 0) throw windows_failure("starting Winsock", static_cast<DWORD>(error));
}

}  // namespace

Socket::Socket(int family) {
  start_winsock();
  socket_ =
      ::WSASocketW(family, SOCK_STREAM, IPPROTO_TCP, nullptr, 0, WSA_FLAG_OVERLAPPED | WSA_FLAG_NO_HANDLE_INHERIT);
}

Addresses look_up(const std::string& host, std::uint16_t port, int type, int flags) {
  start_winsock();
  const bool in_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  const std::string plain = in_brackets ? host.substr(1, host.size() - 2) : host;
  addrinfo wanted{};
  wanted.ai_socktype = type;
  wanted.ai_flags = flags;
  addrinfo* found = nullptr;
  const int error = ::getaddrinfo(plain.c_str(), std::to_string(port).c_str(), &wanted, &found);
  if (error != 0) {
    throw Failure(Failure::Kind::not_found, "the host " + plain + " is not known (" +
                                                text_of_error(static_cast<DWORD>(error)) +
                                                "): check the name and the network");
  }
  return {found, &::freeaddrinfo};
}

void send_at_once(SOCKET socket) {
  const BOOL on = TRUE;
  ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, reinterpret_cast<const char*>(&on), sizeof on);
}

}  // namespace absenc::os
