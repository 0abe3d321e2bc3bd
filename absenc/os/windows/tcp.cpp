// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/tcp.hpp"

#include <memory>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/overlapped.hpp"
#include "absenc/os/windows/sockets.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

namespace {

// Connects to `address`. Returns 0 with the connection in `socket`, or an error of Winsock.
DWORD connect_to(const addrinfo& address, Time deadline, Socket& socket) {
  socket = Socket(address.ai_family);
  if (!socket) return static_cast<DWORD>(::WSAGetLastError());
  const Handle done = make_event();
  ::WSAEventSelect(socket.get(), done.get(), FD_CONNECT);
  DWORD error = 0;
  if (::connect(socket.get(), address.ai_addr, static_cast<int>(address.ai_addrlen)) != 0) {
    error = static_cast<DWORD>(::WSAGetLastError());
    if (error != WSAEWOULDBLOCK) return error;
    const HANDLE event = done.get();
    if (!wait_any({&event, 1}, deadline)) return WSAETIMEDOUT;
    WSANETWORKEVENTS events{};
    ::WSAEnumNetworkEvents(socket.get(), done.get(), &events);
    error = static_cast<DWORD>(events.iErrorCode[FD_CONNECT_BIT]);
  }
  ::WSAEventSelect(socket.get(), nullptr, 0);
  return error;
}

Failure connect_failure(const std::string& host, std::uint16_t port, DWORD error) {
  const std::string where = host + " port " + std::to_string(port);
  switch (error) {
    case WSAECONNREFUSED:
      return {Failure::Kind::not_found, "nothing listens on " + where + ": check the port and that the server runs"};
    case WSAETIMEDOUT:
      return {Failure::Kind::lost, where + " does not answer: check the address, the cable and the firewall"};
    case WSAEHOSTUNREACH:
    case WSAENETUNREACH:
      return {Failure::Kind::not_found, "there is no way to " + where + ": check the address and the network"};
    default:
      return windows_failure("connecting to " + where, error);
  }
}

Descriptor open_connection(const std::string& host, std::uint16_t port) {
  const Addresses addresses = look_up(host, port);
  const Time deadline = now() + 3s;
  DWORD error = WSAETIMEDOUT;
  for (const addrinfo* address = addresses.get(); address != nullptr; address = address->ai_next) {
    Socket socket;
    error = connect_to(*address, deadline, socket);
    if (error != 0) continue;
    send_at_once(socket.get());
    return descriptor_of(std::make_unique<SocketStream>(socket.release()));
  }
  throw connect_failure(host, port, error);
}

}  // namespace

TcpPort::TcpPort(const std::string& host, std::uint16_t port)
    : DescriptorPort(open_connection(host, port), "the connection to " + host + " port " + std::to_string(port)) {
  set_latency(200ms);
}

std::ptrdiff_t TcpPort::write_some(Bytes bytes) { return DescriptorPort::write_some(bytes); }

}  // namespace absenc::os
