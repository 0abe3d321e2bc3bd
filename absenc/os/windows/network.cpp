// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/network.hpp"

#include <array>
#include <cerrno>
#include <cstring>

#include "absenc/os/error.hpp"
#include "absenc/os/listener.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/sockets.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

namespace {

// Windows wakes a wait by the event of a socket, but only `select` says whether the socket can be read or written now.
class SocketWatch final : public Waitable {
 public:
  explicit SocketWatch(SOCKET socket) : socket_(socket), wakes_(make_event()), can_write_(make_event()) {
    ::WSAEventSelect(socket_, wakes_.get(), FD_READ | FD_WRITE | FD_CONNECT | FD_CLOSE);
  }
  // The library may have closed the socket already; then this call fails.
  ~SocketWatch() override { ::WSAEventSelect(socket_, nullptr, 0); }

  HANDLE readable() override {
    ::ResetEvent(wakes_.get());  // first, so that no byte that arrives meanwhile is missed
    if (state().to_read) ::SetEvent(wakes_.get());
    return wakes_.get();
  }
  HANDLE writable() override {
    state().to_write ? ::SetEvent(can_write_.get()) : ::ResetEvent(can_write_.get());
    return can_write_.get();
  }

 private:
  [[nodiscard]] Ready state() const {
    fd_set read{}, written{}, failed{};
    for (fd_set* set : {&read, &written, &failed}) {
      set->fd_count = 1;
      set->fd_array[0] = socket_;
    }
    timeval at_once{};
    if (::select(0, &read, &written, &failed, &at_once) < 0) return {.to_read = true};  // reading reports the reason
    return {read.fd_count != 0 || failed.fd_count != 0, written.fd_count != 0};
  }

  SOCKET socket_;
  Handle wakes_;
  Handle can_write_;
};

}  // namespace

Datagrams::Datagrams(const std::string& host, std::uint16_t port) {
  const Addresses one = look_up(host, port, SOCK_DGRAM);
  Socket socket(::WSASocketW(one->ai_family, SOCK_DGRAM, IPPROTO_UDP, nullptr, 0, WSA_FLAG_NO_HANDLE_INHERIT));
  unsigned long does_not_block = 1;
  if (!socket || ::ioctlsocket(socket.get(), static_cast<long>(FIONBIO), &does_not_block) != 0 ||
      ::connect(socket.get(), one->ai_addr, static_cast<int>(one->ai_addrlen)) != 0) {
    throw windows_failure("sending to " + host + ":" + std::to_string(port), static_cast<DWORD>(::WSAGetLastError()));
  }
  socket_ = descriptor_of(std::make_unique<HeldSocket>(std::move(socket)));
}

bool Datagrams::send(std::string_view text) {
  const SOCKET socket = dynamic_cast<HeldSocket&>(*waitable_of(socket_.get())).socket.get();
  const auto size = static_cast<int>(text.size());
  return ::send(socket, text.data(), size, 0) == size;
}

std::vector<std::string> addresses_of(const std::string& host) {
  std::vector<std::string> addresses;
  const Addresses found = look_up(host, 0);
  for (const addrinfo* one = found.get(); one != nullptr; one = one->ai_next) {
    addresses.push_back(host_text(*one->ai_addr));
  }
  return addresses;
}

Ready wait_for_socket(int socket, bool for_writing, Time longest) {
  Waitable& object = *waitable_of(socket);
  const std::array events{object.readable(), object.writable()};
  const auto wait = static_cast<DWORD>(std::chrono::duration_cast<std::chrono::milliseconds>(longest).count());
  ::WaitForMultipleObjects(for_writing ? 2 : 1, events.data(), FALSE, wait);
  return {is_set(events[0]), for_writing && is_set(events[1])};
}

void LibrarySocket::watch(int socket) {
  if (socket == socket_) return;
  socket_ = socket;
  event_ = socket < 0 ? Descriptor() : descriptor_of(std::make_unique<SocketWatch>(static_cast<SOCKET>(socket)));
}

int LibrarySocket::descriptor() const { return event_.get(); }

std::string socket_error_text(int error) {
  constexpr int first_of_winsock = 10000;
  return error < first_of_winsock ? std::strerror(error) : text_of_error(static_cast<DWORD>(error));
}

std::string host_name() {
  std::array<wchar_t, 256> name{};
  auto size = static_cast<DWORD>(name.size());
  return ::GetComputerNameExW(ComputerNameDnsHostname, name.data(), &size) != 0 ? utf8({name.data(), size})
                                                                                : std::string();
}

}  // namespace absenc::os
