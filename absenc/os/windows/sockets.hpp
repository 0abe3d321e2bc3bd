// SPDX-License-Identifier: Apache-2.0
// Winsock: its start, names of hosts, sockets that close themselves.
#pragma once

#include <winsock2.h>
#include <ws2tcpip.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

/// A socket that closes itself.
class Socket {
 public:
  Socket() = default;
  /// Makes a socket for overlapped I/O; `family`: AF_INET or AF_INET6. Is empty after an error (WSAGetLastError).
  explicit Socket(int family);
  explicit Socket(SOCKET socket) : socket_(socket) {}
  Socket(Socket&& other) noexcept : socket_(std::exchange(other.socket_, INVALID_SOCKET)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(socket_, other.socket_);
    return *this;
  }
  ~Socket() {
    if (*this) ::closesocket(socket_);
  }

  [[nodiscard]] SOCKET get() const { return socket_; }
  [[nodiscard]] SOCKET release() { return std::exchange(socket_, INVALID_SOCKET); }
  [[nodiscard]] explicit operator bool() const { return socket_ != INVALID_SOCKET; }

 private:
  SOCKET socket_ = INVALID_SOCKET;
};

/// A socket that a descriptor holds. No wait watches it.
struct HeldSocket final : Waitable {
  explicit HeldSocket(Socket held) : socket(std::move(held)) {}
  HANDLE readable() override { return nullptr; }

  Socket socket;
};

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

/// Returns the addresses of `host`, an IPv6 address also in brackets, for sockets of this type. `flags`: AI_PASSIVE for
/// listening. Throws Failure `not_found`.
[[nodiscard]] Addresses look_up(const std::string& host, std::uint16_t port, int type = SOCK_STREAM, int flags = 0);

/// Sends small pieces at once: a request must not wait for the acknowledgement of the previous one.
void send_at_once(SOCKET socket);

}  // namespace absenc::os
