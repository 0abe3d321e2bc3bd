// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/emulator_port.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <thread>

#include "absenc/os/linux/testing.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/tcp.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using Kind = ByteEvent::Kind;
namespace fs = std::filesystem;

constexpr LineSettings fast{.rate = 2'500'000};
const Data request{0x1A, 0x00, 0x0A, 0xFF};

Data receive(StreamPort& port) {
  ByteEvent event = port.wait({.at = never, .answer = 5s});
  if (event.kind == Kind::sent) event = port.wait({.at = never, .answer = 5s});
  EXPECT_EQ(event.kind, Kind::received);
  return data(event.items);
}

void expect_quiet(StreamPort& port) {
  ByteEvent event = port.wait({.at = port.now() + 5ms});
  if (event.kind == Kind::sent) event = port.wait({.at = port.now() + 5ms});
  EXPECT_EQ(event.kind, Kind::timer);
}

TEST(EmulatorPort, TalksToASerialPort) {
  EmulatorPort device;
  SerialPort host(device.path(), fast);
  host.begin(transfer(request));
  EXPECT_EQ(receive(device), request);
  // The port adds its latency of 0.2 ms to the gap limit of 1 ns, and then reports that the frame has ended.
  EXPECT_EQ(device.wait({.at = never, .gap = 1ns}).kind, Kind::silence);
  const Data reply{1, 2, 3};
  device.begin(transfer(reply));
  EXPECT_EQ(receive(host), reply);
  expect_quiet(device);  // the device must not receive its own reply
  EXPECT_EQ(device.dropped(), 0u);
}

TEST(EmulatorPort, DeviceWithARateReceivesOnlyThatRate) {
  EmulatorPort device({}, 0);
  SerialPort at_9600(device.path(), {.rate = 9600});
  TcpPort without_rate("127.0.0.1", device.tcp_port());
  const auto set = [](StreamPort& port, std::uint32_t rate) {
    port.begin({.kind = ByteStep::Kind::configure, .rate = rate});
  };
  at_9600.begin(transfer(request));
  EXPECT_EQ(receive(device), request) << "it has not said which";
  set(device, 19'200);
  at_9600.begin(transfer(request));
  expect_quiet(device);
  without_rate.begin(transfer(request));
  EXPECT_EQ(receive(device), request);
  set(at_9600, 19'200);
  at_9600.begin(transfer(request));
  EXPECT_EQ(receive(device), request);
  set(device, 9600);
  at_9600.begin(transfer(request));
  expect_quiet(device);
}

TEST(EmulatorPort, UnsetTerminalWorksAtEveryRate) {
  EmulatorPort device;
  device.begin({.kind = ByteStep::Kind::configure, .rate = 19'200});
  const Descriptor plain(::open(device.path().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  ASSERT_EQ(::write(plain.get(), request.data(), request.size()), static_cast<ssize_t>(request.size()));
  EXPECT_EQ(receive(device), request);
}

TEST(EmulatorPort, IsOneLineForAllItsEnds) {
  EmulatorPort device({}, 0);
  ASSERT_NE(device.tcp_port(), 0);
  SerialPort serial(device.path(), fast);
  TcpPort first("127.0.0.1", device.tcp_port());
  {
    TcpPort second("127.0.0.1", device.tcp_port());
    for (StreamPort* host :
         {static_cast<StreamPort*>(&second), static_cast<StreamPort*>(&first), static_cast<StreamPort*>(&serial)}) {
      host->begin(transfer(request));
      EXPECT_EQ(receive(device), request);
    }
    const Data reply{1, 2, 3};
    device.begin(transfer(reply));
    EXPECT_EQ(receive(serial), reply);
    EXPECT_EQ(receive(first), reply);
    EXPECT_EQ(receive(second), reply);
  }
  expect_quiet(device);  // the port also notices here that the TCP client `second` has closed its connection
  // The test sends twice, because the first write to a connection that the other side has closed still succeeds.
  for (int i = 0; i < 2; ++i) {
    device.begin(transfer(request));
    EXPECT_EQ(receive(first), request);
  }
  EXPECT_EQ(device.dropped(), 0u);
}

TEST(EmulatorPort, RefusesClientsAboveItsLimit) {
  EmulatorPort device({}, 0);
  std::vector<std::unique_ptr<TcpPort>> hosts;
  for (int i = 0; i < 33; ++i) {
    hosts.push_back(std::make_unique<TcpPort>("127.0.0.1", device.tcp_port()));
    expect_quiet(device);
  }
  hosts.front()->begin(transfer(request));
  EXPECT_EQ(receive(device), request);
  hosts.back()->set_end(now() + 5s);
  EXPECT_EQ(failure_of([&] { static_cast<void>(hosts.back()->wait({.at = never})); }).kind(), Failure::Kind::lost);
}

// Simulates a busy machine: another thread competes for the one processor.
TEST(EmulatorPort, ReportsSchedulingDelayAsLate) {
  cpu_set_t before;
  cpu_set_t one;
  ASSERT_EQ(::sched_getaffinity(0, sizeof before, &before), 0);
  CPU_ZERO(&one);
  CPU_SET(::sched_getcpu(), &one);
  ASSERT_EQ(::sched_setaffinity(0, sizeof one, &one), 0);
  EmulatorPort device;
  SerialPort host(device.path(), fast);
  const auto receives = [&] {
    host.begin(transfer(request));
    return device.wait({.at = never, .answer = 5s}).late;
  };
  {
    const std::jthread busy([](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
      }
    });
    const Time end = os::now() + 60s;
    Time late{};
    while (late < 1ms && os::now() < end) late = receives();
    EXPECT_GE(late, 1ms);
  }
  ::sched_setaffinity(0, sizeof before, &before);
}

TEST(EmulatorPort, ContinuesWhenAUserLeaves) {
  EmulatorPort device;
  for (int i = 0; i < 3; ++i) {
    SerialPort host(device.path(), fast);
    host.begin(transfer(request));
    EXPECT_EQ(receive(device), request);
    device.begin(transfer(request));
    EXPECT_EQ(receive(host), request);
  }
  expect_quiet(device);
}

TEST(EmulatorPort, DiscardsBytesForTheNextUser) {
  EmulatorPort device;
  const Data frame(1000, 0x55);
  // no program reads the terminal, so that the port drops bytes once the terminal is full
  while (device.dropped() == 0) device.begin(transfer(frame));
  const Time written = now();
  // The port discards unread bytes of the previous program only if its last reply is at least 200 ms old.
  sleep_until(written + 200ms);
  // The test opens the terminal directly: a SerialPort would discard the unread bytes itself.
  const Descriptor host(::open(device.path().c_str(), O_RDWR | O_NOCTTY));
  put(host.get(), request);
  EXPECT_EQ(receive(device), request);
  device.begin(transfer(request));
  EXPECT_EQ(get(host.get()), request);
}

TEST(EmulatorPort, KeepsReplyWhenAnotherProgramOpensTheTerminal) {
  EmulatorPort device;
  const Descriptor host(::open(device.path().c_str(), O_RDWR | O_NOCTTY));
  device.begin(transfer(request));
  Descriptor(::open(device.path().c_str(), O_RDWR | O_NOCTTY)).close();
  expect_quiet(device);
  EXPECT_EQ(get(host.get()), request);
}

TEST(EmulatorPort, IsNotLockedByAUserWhoLeft) {
  EmulatorPort device;
  Descriptor(::open(device.path().c_str(), O_RDWR | O_NOCTTY)).close();
  {
    const Descriptor greedy(::open(device.path().c_str(), O_RDWR | O_NOCTTY));
    ASSERT_EQ(::ioctl(greedy.get(), TIOCEXCL), 0);
  }
  expect_quiet(device);
  // The test reads the exclusive flag of the terminal, because root can open an exclusive terminal.
  const Descriptor next(::open(device.path().c_str(), O_RDWR | O_NOCTTY));
  int exclusive = 1;
  ASSERT_EQ(::ioctl(next.get(), TIOCGEXCL, &exclusive), 0);
  EXPECT_EQ(exclusive, 0);
}

TEST(EmulatorPort, PauseIsShorterWhereNoMoreBytesAreExpected) {
  EmulatorPort device;
  device.set_latency(std::chrono::hours(1));
  const Descriptor host(::open(device.path().c_str(), O_RDWR | O_NOCTTY));
  put(host.get(), {0x55});
  ASSERT_EQ(device.wait({.at = never}).kind, Kind::received);
  EXPECT_EQ(device.wait({.expect = 1, .at = now() + 5ms, .gap = 1us}).kind, Kind::timer);
  EXPECT_EQ(device.wait({.at = never, .gap = 1us}).kind, Kind::silence);
}

TEST(EmulatorPort, EndsInTime) {
  EmulatorPort device;
  device.set_end(now() + 3ms);
  EXPECT_THROW(static_cast<void>(device.wait({.at = never})), Ended);
}

TEST(EmulatorPort, IgnoresRatesAndWires) {
  EmulatorPort device;
  device.begin({.kind = ByteStep::Kind::configure, .rate = 9600});
  device.begin({.kind = ByteStep::Kind::pulse});
  EXPECT_EQ(device.wait({}).kind, Kind::sent);
}

TEST(EmulatorPort, LinksToItself) {
  const TemporaryDirectory directory;
  const fs::path link = directory.path() / "encoder";
  fs::create_symlink("/dev/pts/999999", link);  // a link left by an emulator that was killed
  {
    EmulatorPort device(link);
    EXPECT_EQ(device.path(), link);
    SerialPort host(link, fast);
    host.begin(transfer(request));
    EXPECT_EQ(receive(device), request);
  }
  EXPECT_FALSE(fs::exists(fs::symlink_status(link)));
}

TEST(EmulatorPort, IsNotReplacedWhileItLives) {
  const TemporaryDirectory directory;
  const fs::path link = directory.path() / "encoder";
  std::string terminal;
  {
    const EmulatorPort first(link);
    terminal = fs::read_symlink(link);
    try {
      const EmulatorPort second(link);
      FAIL();
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.kind(), Failure::Kind::in_use);
      EXPECT_NE(std::string(failure.what()).find("running"), std::string::npos);
    }
    EXPECT_EQ(fs::read_symlink(link), terminal);
  }
  // The pseudo-terminal number of a killed emulator now belongs to a program that is no emulator.
  const Descriptor other(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  std::array<char, 64> name{};
  ASSERT_EQ(::grantpt(other.get()), 0);
  ASSERT_EQ(::unlockpt(other.get()), 0);
  ASSERT_EQ(::ptsname_r(other.get(), name.data(), name.size()), 0);
  fs::create_symlink(name.data(), link);
  const EmulatorPort third(link);
  EXPECT_NE(fs::read_symlink(link), name.data());
  // The pseudo-terminal number of a killed emulator now belongs to an emulator with another link.
  const fs::path stale = directory.path() / "stale";
  fs::create_symlink(fs::read_symlink(link), stale);
  const EmulatorPort fourth(stale);
  EXPECT_NE(fs::read_symlink(stale), fs::read_symlink(link));
}

TEST(EmulatorPort, ReplacesNothingButLinksToPseudoTerminals) {
  const TemporaryDirectory directory;
  const fs::path file = directory.path() / "file", link = directory.path() / "link";
  std::ofstream(file) << "precious";
  fs::create_symlink(file, link);
  for (const fs::path& path : {file, link, directory.path()}) {
    EXPECT_EQ(failure_of([&] { const EmulatorPort device(path); }).kind(), Failure::Kind::in_use) << path;
  }
  EXPECT_EQ(fs::file_size(file), 8u);
  EXPECT_TRUE(fs::is_symlink(link));
  const auto nowhere = [&] { const EmulatorPort device(directory.path() / "no" / "where"); };
  EXPECT_EQ(failure_of(nowhere).kind(), Failure::Kind::system);
}

TEST(EmulatorPort, RemovesOnlyItsOwnLink) {
  const TemporaryDirectory directory;
  const fs::path link = directory.path() / "encoder";
  {
    const EmulatorPort device(link);
    fs::remove(link);
    fs::create_symlink("/dev/pts/999999", link);
  }
  EXPECT_TRUE(fs::is_symlink(link));
}

TEST(EmulatorPort, ReportsTcpPortInUse) {
  const EmulatorPort device({}, 0);
  const auto second = [&] { const EmulatorPort other({}, device.tcp_port()); };
  EXPECT_EQ(failure_of(second).kind(), Failure::Kind::in_use);
}

}  // namespace
}  // namespace absenc::os
