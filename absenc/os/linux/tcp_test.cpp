// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/tcp.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "absenc/os/linux/testing.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using Kind = Failure::Kind;

// A socket on a free port of the loopback interface.
struct TestListener {
  explicit TestListener(int family = AF_INET) : socket(::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (family == AF_INET6) {
      sockaddr_in6 address{};
      address.sin6_family = AF_INET6;
      address.sin6_addr = in6addr_loopback;
      bound = ::bind(socket.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    } else {
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      bound = ::bind(socket.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    }
    sockaddr_in6 address{};
    socklen_t size = sizeof address;
    ::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size);
    port = ntohs(address.sin6_port);  // the port number has the same offset in sockaddr_in and sockaddr_in6
  }
  void listen(int backlog) const { ASSERT_EQ(::listen(socket.get(), backlog), 0); }
  [[nodiscard]] Descriptor accept() const { return Descriptor(::accept(socket.get(), nullptr, nullptr)); }

  Descriptor socket;
  bool bound = false;
  std::uint16_t port = 0;
};

void expect_exchange(const std::string& host, const TestListener& listener) {
  listener.listen(1);
  TcpPort port(host, listener.port);
  const Descriptor server = listener.accept();
  const Data request{1, 2, 3};
  port.begin(transfer(request));
  EXPECT_EQ(get(server.get()), request);
  put(server.get(), {4, 5});
  EXPECT_EQ(port.wait({}).kind, ByteEvent::Kind::sent);
  const ByteEvent event = port.wait({.at = never});
  ASSERT_EQ(event.kind, ByteEvent::Kind::received);
  EXPECT_EQ(data(event.items), (Data{4, 5}));
  EXPECT_EQ(port.latency(), 200ms);
}

TEST(TcpPort, ExchangesBytes) { expect_exchange("127.0.0.1", TestListener()); }

TEST(TcpPort, KnowsNames) { expect_exchange("localhost", TestListener()); }

TEST(TcpPort, KnowsIpv6) {
  if (!TestListener(AF_INET6).bound) GTEST_SKIP() << "no IPv6 here";
  expect_exchange("[::1]", TestListener(AF_INET6));
  expect_exchange("::1", TestListener(AF_INET6));
}

TEST(TcpPort, ReportsRefusedConnection) {
  // the listener binds a port but does not listen, so that no other program can take the port
  const TestListener listener;
  const Failure failure = failure_of([&] { const TcpPort port("127.0.0.1", listener.port); });
  EXPECT_EQ(failure.kind(), Kind::not_found);
  EXPECT_EQ(std::string(failure.what()), "nothing listens on 127.0.0.1 port " + std::to_string(listener.port) +
                                             ": check the port and that the server runs");
}

TEST(TcpPort, ReportsUnknownHost) {
  // The invalid address is refused without a name server.
  const Failure failure = failure_of([] { const TcpPort port("[::no]", 4001); });
  EXPECT_EQ(failure.kind(), Kind::not_found);
  EXPECT_NE(std::string_view(failure.what()).find("::no is not known"), std::string_view::npos) << failure.what();
}

TEST(TcpPort, TimesOutOnSilentServer) {
  const TestListener listener;
  listener.listen(0);
  // the first connection fills the queue of the listener, so the kernel drops further connection requests
  const TcpPort first("127.0.0.1", listener.port);
  const Time begin = now();
  EXPECT_EQ(failure_of([&] { const TcpPort second("127.0.0.1", listener.port); }).kind(), Kind::lost);
  EXPECT_GE(now() - begin, 3s);
}

TEST(TcpPort, IsLostWhenTheServerCloses) {
  const TestListener listener;
  listener.listen(1);
  TcpPort port("127.0.0.1", listener.port);
  Descriptor server = listener.accept();
  // the server resets the connection when it closes, so the next write of the port fails at once
  const linger reset{1, 0};
  ASSERT_EQ(::setsockopt(server.get(), SOL_SOCKET, SO_LINGER, &reset, sizeof reset), 0);
  server.close();
  EXPECT_EQ(failure_of([&] { static_cast<void>(port.wait({.at = never})); }).kind(), Kind::lost);
  const Data bytes{1};
  // The write fails without raising SIGPIPE.
  EXPECT_EQ(failure_of([&] { port.begin(transfer(bytes)); }).kind(), Kind::lost);
}

}  // namespace
}  // namespace absenc::os
