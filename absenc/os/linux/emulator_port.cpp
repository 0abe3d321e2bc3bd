// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/emulator_port.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/serial_settings.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_clients = 32;

void check(bool good, const std::string& what) {
  if (!good) throw system_failure(what, errno);
}

// Returns a socket whose kernel name marks `link` as in use; empty, with errno, on an error.
Descriptor bind_name_of(const fs::path& link) {
  struct stat folder {};
  Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const fs::path parent = link.has_parent_path() ? link.parent_path() : fs::path(".");
  if (!socket || ::stat(parent.c_str(), &folder) < 0) return {};
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::string name = "absenc " + std::to_string(folder.st_dev) + " " + std::to_string(folder.st_ino) + " ";
  const std::string file = link.filename();
  const std::size_t room = sizeof address.sun_path - 1 - name.size();
  name += file.substr(file.size() - std::min(file.size(), room));
  // The name begins with a zero byte: it is an abstract socket name without a file.
  std::copy(name.begin(), name.end(), address.sun_path + 1);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  if (::bind(socket.get(), reinterpret_cast<sockaddr*>(&address), size) < 0) return {};
  return socket;
}

}  // namespace

EmulatorPort::EmulatorPort(std::string link, std::optional<std::uint16_t> tcp_port) {
  set_latency(2ms);
  set_idle_latency(200us);
  // The time of a sent reply counts from before write(2), which wakes the host: the next request often arrives before
  // this program continues.
  set_leaving(Leaving::from_write);
  open_terminal();
  if (tcp_port) listen_on(*tcp_port);
  for (const Descriptor* end : {&terminal_.master, &watch_, &listener_}) {
    if (*end) poller().add(end->get());
  }
  link_ = std::move(link);
  // Last step of the constructor: a program that waits for the link may open it at once.
  if (!link_.empty()) make_link();
}

EmulatorPort::~EmulatorPort() {
  std::error_code ignored;
  if (!link_.empty() && fs::read_symlink(link_, ignored) == terminal_.path) fs::remove(link_, ignored);
}

void EmulatorPort::open_terminal() {
  terminal_ = open_terminal_pair();
  // This port has opened the slave already, so the watch reports only other programs.
  watch_ = Descriptor(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC));
  if (watch_) ::inotify_add_watch(watch_.get(), terminal_.path.c_str(), IN_OPEN | IN_CLOSE);
}

void EmulatorPort::listen_on(std::uint16_t port) {
  const std::string what = "listening on TCP port " + std::to_string(port);
  listener_ = Descriptor(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  check(static_cast<bool>(listener_), what);
  const int on = 1;
  ::setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (::bind(listener_.get(), generic, size) < 0) {
    if (errno != EADDRINUSE) throw system_failure(what, errno);
    throw Failure(Failure::Kind::in_use, "TCP port " + std::to_string(port) + " is in use: choose another, or 0");
  }
  check(::listen(listener_.get(), 8) == 0 && ::getsockname(listener_.get(), generic, &size) == 0, what);
  tcp_port_ = ntohs(address.sin_port);
}

void EmulatorPort::make_link() {
  std::error_code error;
  errno = 0;
  in_use_marker_ = bind_name_of(link_);
  const bool served = !in_use_marker_ && errno == EADDRINUSE;
  if (const auto there = fs::symlink_status(link_, error); fs::exists(there)) {
    const std::string target = fs::is_symlink(there) ? fs::read_symlink(link_, error).native() : "";
    if (!target.starts_with("/dev/pts/")) {
      throw Failure(Failure::Kind::in_use,
                    link_ + " exists and is no link to a pseudo-terminal: remove it, or choose another path");
    }
    if (served && fs::exists(target)) {
      throw Failure(Failure::Kind::in_use, link_ + " is in use by a virtual encoder that is running, at " + target +
                                               ": end it, or choose another path");
    }
    fs::remove(link_, error);
  }
  fs::create_symlink(terminal_.path, link_, error);
  if (error) throw system_failure("making the link " + link_, error.value());
}

std::size_t EmulatorPort::read_some(MutableBytes into, std::span<const int> ready) {
  // `users_changed` discards the bytes that the previous program on the terminal did not read. It is called before
  // requests are read, so that it cannot discard the replies to them.
  if (std::find(ready.begin(), ready.end(), watch_.get()) != ready.end()) users_changed();
  std::size_t filled = 0;
  for (const int descriptor : ready) {
    if (descriptor == watch_.get() || filled == into.size()) continue;
    if (descriptor == listener_.get()) {
      accept_client();
      continue;
    }
    const ssize_t size = ::read(descriptor, into.data() + filled, into.size() - filled);
    if (size > 0 && descriptor == terminal_.master.get() && !rate_matches_terminal()) continue;
    if (size > 0) {
      filled += static_cast<std::size_t>(size);
    } else if (descriptor != terminal_.master.get() && (size == 0 || (errno != EAGAIN && errno != EINTR))) {
      drop_client(descriptor);
    }
  }
  return filled;
}

// Returns how long received bytes may have waited because this thread could not run.
Time EmulatorPort::lateness() {
  const Time now = os::now();
  if (now < delay_read_at_ + 500us) return lateness_;
  delay_read_at_ = now;
  const Time delay = delay_.take();
  if (delay < lateness_ && now < lateness_until_) return lateness_;
  lateness_until_ = now + 1s;
  return lateness_ = delay;
}

bool EmulatorPort::rate_matches_terminal() const {
  constexpr std::uint32_t unset = 38'400;
  if (device_rate_ == 0) return true;
  const std::uint32_t rate = terminal_rate(terminal_.slave.get());
  return rate == unset || rates_agree(device_rate_, rate);
}

void EmulatorPort::drop_client(int descriptor) {
  poller().remove(descriptor);
  std::erase_if(clients_, [descriptor](const Descriptor& client) { return client.get() == descriptor; });
}

void EmulatorPort::accept_client() {
  Descriptor client(::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  // If there are as many TCP clients as permitted, the new connection is closed at once.
  if (!client || clients_.size() == most_clients) return;
  const int on = 1;
  ::setsockopt(client.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  poller().add(client.get());
  clients_.push_back(std::move(client));
}

// Ends an exclusive mode (TIOCEXCL) that the last program left: it would lock out the next program.
void EmulatorPort::users_changed() {
  std::array<std::byte, 4096> events;
  while (::read(watch_.get(), events.data(), events.size()) > 0) {
  }
  ::ioctl(terminal_.slave.get(), TIOCNXCL);
  if (os::now() - sent_at() < 200ms) return;
  ::tcflush(terminal_.slave.get(), TCIFLUSH);
}

void EmulatorPort::write_all(Bytes bytes) {
  write_terminal(bytes);
  for (const Descriptor& client : clients_) {
    const ssize_t size = ::send(client.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    dropped_ += bytes.size() - static_cast<std::size_t>(std::max<ssize_t>(size, 0));
  }
}

void EmulatorPort::write_terminal(Bytes bytes) {
  const ssize_t size = ::write(terminal_.master.get(), bytes.data(), bytes.size());
  dropped_ += bytes.size() - static_cast<std::size_t>(std::max<ssize_t>(size, 0));
}

}  // namespace absenc::os
