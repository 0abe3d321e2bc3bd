// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/datagrams.hpp"

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>

#include "absenc/os/error.hpp"

namespace absenc::os {

Datagrams::Datagrams(const std::string& host, std::uint16_t port) {
  addrinfo wanted{};
  wanted.ai_flags = AI_NUMERICSERV;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int error = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found);
  if (error != 0) throw Failure(Failure::Kind::not_found, "cannot send to " + host + ": " + ::gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> one(found, &::freeaddrinfo);
  socket_ = Descriptor(::socket(one->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket_.get() < 0 || ::connect(socket_.get(), one->ai_addr, one->ai_addrlen) < 0) {
    throw system_failure("sending to " + host + ":" + std::to_string(port), errno);
  }
}

bool Datagrams::send(std::string_view text) {
  return ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : std::string();
}

}  // namespace absenc::os
