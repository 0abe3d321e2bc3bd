// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/tcp.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>

#include "absenc/os/error.hpp"
#include "absenc/os/linux/addresses.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

namespace {

// Connects to `address`. Returns 0 with the connection in `descriptor`, or a value of errno.
int connect_to(const addrinfo& address, Time deadline, Descriptor& descriptor) {
  descriptor = Descriptor(::socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!descriptor) return errno;
  if (::connect(descriptor.get(), address.ai_addr, address.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  Watched connected{.descriptor = descriptor.get(), .wanted = {.to_write = true}};
  if (!wait_for({&connected, 1}, deadline)) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(descriptor.get(), SOL_SOCKET, SO_ERROR, &error, &size);
  return error;
}

Failure connect_failure(const std::string& host, std::uint16_t port, int error) {
  const std::string where = host + " port " + std::to_string(port);
  switch (error) {
    case ECONNREFUSED:
      return {Failure::Kind::not_found, "nothing listens on " + where + ": check the port and that the server runs"};
    case ETIMEDOUT:
      return {Failure::Kind::lost, where + " does not answer: check the address, the cable and the firewall"};
    case EHOSTUNREACH:
    case ENETUNREACH:
      return {Failure::Kind::not_found, "there is no way to " + where + ": check the address and the network"};
    default:
      return system_failure("connecting to " + where, error);
  }
}

Descriptor open_connection(const std::string& host, std::uint16_t port) {
  const Addresses addresses = look_up(host, port, SOCK_STREAM, 0, "the host ", " is not known");
  const Time deadline = now() + 3s;
  int error = ETIMEDOUT;
  for (const addrinfo* address = addresses.get(); address != nullptr; address = address->ai_next) {
    Descriptor descriptor;
    error = connect_to(*address, deadline, descriptor);
    if (error != 0) continue;
    const int on = 1;  // TCP_NODELAY: a request must not wait for the acknowledgement of the previous one
    ::setsockopt(descriptor.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return descriptor;
  }
  throw connect_failure(host, port, error);
}

}  // namespace

TcpPort::TcpPort(const std::string& host, std::uint16_t port)
    : DescriptorPort(open_connection(host, port), "the connection to " + host + " port " + std::to_string(port)) {
  set_latency(200ms);
}

// Unlike write(2), send(2) with MSG_NOSIGNAL raises no SIGPIPE after the other side has closed.
std::ptrdiff_t TcpPort::write_some(Bytes bytes) {
  return ::send(descriptor(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

}  // namespace absenc::os
