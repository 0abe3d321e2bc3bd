// SPDX-License-Identifier: Apache-2.0
// Tests waits, and TCP between a virtual encoder's port and a host's port of this process.
#include <gtest/gtest.h>

#include <functional>

#include "absenc/os/emulator_port.hpp"
#include "absenc/os/poller.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/tcp.hpp"
#include "absenc/os/testing.hpp"
#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;

/// An object that is readable once `set` was called.
class Bell final : public Waitable {
 public:
  HANDLE readable() override { return event_.get(); }
  void set() { ::SetEvent(event_.get()); }

 private:
  Handle event_ = make_event();
};

TEST(Waits, SleepNeverEndsEarly) {
  for (const Time pause : {Time(1ns), Time(100us), Time(1500us), Time(20ms)}) {
    const Time due = now() + pause;
    sleep_until(due);
    EXPECT_GE(now(), due);
    EXPECT_LT(now(), due + 2s);
  }
}

TEST(Waits, ReadyObjectEndsTheWait) {
  auto bell = std::make_unique<Bell>();
  Bell& rung = *bell;
  const Descriptor descriptor = descriptor_of(std::move(bell));
  Watched watched{.descriptor = descriptor.get()};
  EXPECT_FALSE(wait_for({&watched, 1}, now() + 2ms));
  rung.set();
  EXPECT_TRUE(wait_for({&watched, 1}, now() + 10s));
  EXPECT_TRUE(watched.ready.to_read);
}

TEST(Waits, CancelCheckEndsTheWait) {
  int calls = 0;
  const std::function<bool()> over = [&] { return ++calls == 3; };
  const CancelCheck check(over);
  EXPECT_THROW(sleep_until(now() + 60s), Ended);
  EXPECT_EQ(calls, 3);
}

TEST(Waits, PollerReturnsAllThatAreReady) {
  Poller poller;
  std::vector<Descriptor> descriptors;
  std::vector<Bell*> bells;
  for (int i = 0; i < 3; ++i) {
    auto bell = std::make_unique<Bell>();
    bells.push_back(bell.get());
    descriptors.push_back(descriptor_of(std::move(bell)));
    poller.add(descriptors.back().get());
  }
  EXPECT_TRUE(poller.wait(now() + 1ms).empty());
  bells[0]->set();
  bells[2]->set();
  const std::span<const int> ready = poller.wait(now() + 10s);
  ASSERT_EQ(ready.size(), 2u);
  EXPECT_EQ(ready[0], descriptors[0].get());
  EXPECT_EQ(ready[1], descriptors[2].get());
  poller.remove(descriptors[0].get());
  poller.remove(descriptors[2].get());
  EXPECT_TRUE(poller.wait(now() + 1ms).empty());
}

/// Returns the next bytes that `port` receives within ten seconds; empty if none.
Data receive(StreamPort& port) {
  const ByteStep wait{.kind = ByteStep::Kind::wait, .at = port.now() + 10s};
  for (;;) {
    const ByteEvent event = port.wait(wait);
    if (event.kind == ByteEvent::Kind::timer) return {};
    if (event.kind == ByteEvent::Kind::received) return data(event.items);
  }
}

TEST(Tcp, CarriesBytesBetweenHostAndVirtualEncoder) {
  EmulatorPort encoder({}, std::uint16_t{0});
  TcpPort host("127.0.0.1", encoder.tcp_port());
  const Data request{1, 2, 3};
  host.begin(transfer(request));
  EXPECT_EQ(receive(encoder), request);
  const Data reply(3000, 0x55);
  encoder.begin(transfer(reply));
  Data received;
  while (received.size() < reply.size()) {
    const Data piece = receive(host);
    ASSERT_FALSE(piece.empty());
    received.insert(received.end(), piece.begin(), piece.end());
  }
  EXPECT_EQ(received, reply);
  EXPECT_EQ(encoder.dropped(), 0u);
}

TEST(Tcp, ClosedConnectionIsLost) {
  auto encoder = std::make_unique<EmulatorPort>(std::string(), std::uint16_t{0});
  TcpPort host("127.0.0.1", encoder->tcp_port());
  host.begin(transfer(Data{1}));
  EXPECT_EQ(receive(*encoder), Data{1});
  encoder.reset();
  EXPECT_EQ(failure_of([&] { static_cast<void>(receive(host)); }).kind(), Failure::Kind::lost);
}

TEST(Tcp, NothingListensIsNotFound) {
  std::uint16_t port = 0;
  {
    const EmulatorPort encoder({}, std::uint16_t{0});
    port = encoder.tcp_port();
  }
  EXPECT_EQ(failure_of([&] { const TcpPort host("127.0.0.1", port); }).kind(), Failure::Kind::not_found);
}

TEST(Tcp, PortInUseIsRefused) {
  const EmulatorPort encoder({}, std::uint16_t{0});
  EXPECT_EQ(failure_of([&] { const EmulatorPort second({}, encoder.tcp_port()); }).kind(), Failure::Kind::in_use);
}

TEST(EmulatorPort, NeedsTcpBecauseThereAreNoPseudoTerminals) {
  EXPECT_EQ(failure_of([&] { const EmulatorPort port; }).kind(), Failure::Kind::unsupported);
}

}  // namespace
}  // namespace absenc::os
