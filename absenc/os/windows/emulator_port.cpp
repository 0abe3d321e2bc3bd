// SPDX-License-Identifier: Apache-2.0
// A virtual encoder for TCP clients; Windows has no pseudo-terminals.
#include "absenc/os/emulator_port.hpp"

#include <algorithm>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/terminal_pair.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/overlapped.hpp"
#include "absenc/os/windows/sockets.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

namespace {

constexpr std::size_t most_clients = 32;

/// A socket that listens; its event is set while a client waits to be accepted.
class ListeningSocket final : public Waitable {
 public:
  explicit ListeningSocket(Socket socket) : socket_(std::move(socket)), event_(make_event()) {
    ::WSAEventSelect(socket_.get(), event_.get(), FD_ACCEPT);
  }
  HANDLE readable() override { return event_.get(); }
  /// Returns the next client; empty if none waits.
  Socket accept() {
    ::ResetEvent(event_.get());  // `accept` sets it again if more clients wait
    Socket client(::accept(socket_.get(), nullptr, nullptr));
    if (client) ::WSAEventSelect(client.get(), nullptr, 0);  // it has inherited the event
    return client;
  }

 private:
  Socket socket_;
  Handle event_;
};

Failure listen_failure(std::uint16_t port) {
  const auto error = static_cast<DWORD>(::WSAGetLastError());
  if (error == WSAEADDRINUSE || error == WSAEACCES) {  // WSAEACCES: the port is reserved or used exclusively
    return {Failure::Kind::in_use, "TCP port " + std::to_string(port) + " is in use: choose another, or 0"};
  }
  return windows_failure("listening on TCP port " + std::to_string(port), error);
}

}  // namespace

TerminalPair open_terminal_pair() {
  throw Failure(Failure::Kind::unsupported,
                "Windows has no pseudo-terminals: emulate on --tcp PORT, or on a serial port by --port COM5");
}

EmulatorPort::EmulatorPort(std::string link, std::optional<std::uint16_t> tcp_port) {
  if (!link.empty() || !tcp_port) static_cast<void>(open_terminal_pair());
  set_latency(2ms);
  set_idle_latency(200us);
  set_leaving(
      Leaving::from_write);  // a reply wakes the host, whose next request may arrive before this program continues
  listen_on(*tcp_port);
  poller().add(listener_.get());
}

EmulatorPort::~EmulatorPort() = default;

void EmulatorPort::listen_on(std::uint16_t port) {
  Socket socket(AF_INET);
  if (!socket) throw listen_failure(port);
  const BOOL on = TRUE;  // without it another program could listen on the same port and take our clients
  ::setsockopt(socket.get(), SOL_SOCKET, SO_EXCLUSIVEADDRUSE, reinterpret_cast<const char*>(&on), sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  int size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (::bind(socket.get(), generic, size) != 0 || ::listen(socket.get(), 8) != 0 ||
      ::getsockname(socket.get(), generic, &size) != 0) {
    throw listen_failure(port);
  }
  tcp_port_ = ntohs(address.sin_port);
  listener_ = descriptor_of(std::make_unique<ListeningSocket>(std::move(socket)));
}

std::size_t EmulatorPort::read_some(MutableBytes into, std::span<const int> ready) {
  std::size_t filled = 0;
  for (const int descriptor : ready) {
    if (descriptor == listener_.get()) {
      accept_client();
      continue;
    }
    if (filled == into.size()) break;
    const std::ptrdiff_t size = waitable_of(descriptor)->read(into.subspan(filled));
    if (size > 0) {
      filled += static_cast<std::size_t>(size);
    } else if (size == 0 || errno != EAGAIN) {
      drop_client(descriptor);
    }
  }
  return filled;
}

Time EmulatorPort::lateness() { return delay_.take(); }

void EmulatorPort::drop_client(int descriptor) {
  poller().remove(descriptor);
  std::erase_if(clients_, [descriptor](const Descriptor& client) { return client.get() == descriptor; });
}

void EmulatorPort::accept_client() {
  Socket client = dynamic_cast<ListeningSocket&>(*waitable_of(listener_.get())).accept();
  // At the limit of TCP clients the connection is closed at once.
  if (!client || clients_.size() == most_clients) return;
  send_at_once(client.get());
  clients_.push_back(descriptor_of(std::make_unique<SocketStream>(client.release())));
  poller().add(clients_.back().get());
}

void EmulatorPort::write_all(Bytes bytes) {
  for (const Descriptor& client : clients_) {
    if (waitable_of(client.get())->write(bytes) < 0) dropped_ += bytes.size();
  }
}

}  // namespace absenc::os
