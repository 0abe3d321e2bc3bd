// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/network.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "absenc/os/error.hpp"
#include "absenc/os/linux/addresses.hpp"
#include "absenc/os/listener.hpp"

namespace absenc::os {

Datagrams::Datagrams(const std::string& host, std::uint16_t port) {
  const Addresses one = look_up(host, port, SOCK_DGRAM, 0, "cannot send to ");
  socket_ = Descriptor(::socket(one->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket_.get() < 0 || ::connect(socket_.get(), one->ai_addr, one->ai_addrlen) < 0) {
    throw system_failure("sending to " + host + ":" + std::to_string(port), errno);
  }
}

bool Datagrams::send(std::string_view text) {
  return ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
}

std::vector<std::string> addresses_of(const std::string& host) {
  std::vector<std::string> addresses;
  const Addresses found = look_up(host, 0, SOCK_STREAM, 0, "cannot send to ");
  for (const addrinfo* one = found.get(); one != nullptr; one = one->ai_next) {
    addresses.push_back(host_text(*one->ai_addr));
  }
  return addresses;
}

Ready wait_for_socket(int socket, bool for_writing, Time longest) {
  pollfd watched{socket, static_cast<short>(for_writing ? POLLIN | POLLOUT : POLLIN), 0};
  const auto wait = static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(longest).count());
  if (::poll(&watched, 1, wait) <= 0) return {};
  // A socket with an error, or closed by the other side, counts as ready to read: the caller's read then reports the
  // reason.
  const bool over = (watched.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0;
  return {over || (watched.revents & POLLIN) != 0, (watched.revents & POLLOUT) != 0};
}

void LibrarySocket::watch(int socket) { socket_ = socket; }

int LibrarySocket::descriptor() const { return socket_; }

std::string socket_error_text(int error) { return std::strerror(error); }

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : std::string();
}

}  // namespace absenc::os
