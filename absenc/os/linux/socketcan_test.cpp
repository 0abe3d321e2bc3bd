// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/socketcan.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <netinet/in.h>

#include <fstream>

#include "absenc/os/linux/fake_can_test.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using FrameStep = Step<CanFrame>;
using FrameEvent = Event<CanFrame>;
using EventKind = FrameEvent::Kind;

constexpr LineSettings line{.rate = 250'000};
const CanFrame request{.id = 0x220, .size = 8, .data = {0x80, 0x20}};

can_frame raw(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data);
  return frame;
}

FrameStep sending(const CanFrame& frame) { return {.kind = FrameStep::Kind::transfer, .out = {&frame, 1}}; }

std::string sentence(FakeCan& kernel, const std::string& interface = "can0") {
  return failure_of([&] { const SocketCan port(interface, line, kernel); }).what();
}

TEST(SocketCan, OpensWithRequiredOptions) {
  FakeCan kernel;
  const SocketCan port("can0", line, kernel);
  EXPECT_EQ(kernel.bound, 7);
  EXPECT_EQ((kernel.options[{SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS}]), 0u);
  EXPECT_EQ((kernel.options[{SOL_CAN_RAW, CAN_RAW_LOOPBACK}]), 1u);
  EXPECT_NE((kernel.options[{SOL_CAN_RAW, CAN_RAW_ERR_FILTER}]) & CAN_ERR_BUSOFF, 0u);
  EXPECT_EQ((kernel.options[{SOL_SOCKET, SO_TIMESTAMPNS}]), 1u);
}

TEST(SocketCan, ErrorsStateProblemAndCommand) {
  FakeCan kernel;
  kernel.open_error = EAFNOSUPPORT;
  EXPECT_NE(sentence(kernel).find("modprobe can_raw"), std::string::npos);
  kernel.open_error = EPERM;
  EXPECT_NE(sentence(kernel).find("no permission"), std::string::npos);
  kernel.open_error = 0;
  EXPECT_NE(sentence(kernel, "can1").find("there is no CAN interface can1"), std::string::npos);
  EXPECT_NE(sentence(kernel, "a_name_that_is_far_too_long").find("there is no CAN"), std::string::npos);
  kernel.flags = 0;
  EXPECT_NE(sentence(kernel).find("`sudo ip link set can0 up type can bitrate 250000`"), std::string::npos);
  kernel.type = ARPHRD_ETHER;
  EXPECT_NE(sentence(kernel).find("none of a CAN bus"), std::string::npos);
  kernel.type = ARPHRD_CAN;
  kernel.flags = IFF_UP;
  kernel.bind_error = ENETDOWN;
  EXPECT_NE(sentence(kernel).find("went down"), std::string::npos);
  kernel.bind_error = ENOMEM;
  EXPECT_NE(sentence(kernel).find("binding to can0 failed"), std::string::npos);
}

TEST(SocketCan, AVirtualInterfaceHasNoBitRate) {
  FakeCan kernel;
  kernel.interface = "vcan0";
  SocketCan port("vcan0", line, kernel);
  port.begin({.kind = FrameStep::Kind::configure, .rate = 500'000});
  kernel.flags = 0;
  EXPECT_NE(sentence(kernel, "vcan0").find("`sudo ip link set vcan0 up`"), std::string::npos);
}

TEST(SocketCan, SendsAndReceives) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  port.begin(sending(request));
  kernel.put(raw(0x120, {0x47, 0x26}));
  const FrameEvent sent = port.wait({.at = never});
  EXPECT_EQ(sent.kind, EventKind::sent);
  // `sent` has the time before the write, because a reply can be received before write(2) returns
  EXPECT_LE(sent.at, kernel.written_at);
  const FrameEvent received = port.wait({.at = never});
  ASSERT_EQ(received.kind, EventKind::received);
  EXPECT_GE(received.at, sent.at);
  EXPECT_EQ(received.items[0], (CanFrame{.id = 0x120, .size = 2, .data = {0x47, 0x26}}));
  ASSERT_EQ(kernel.written.size(), 1u);
  EXPECT_EQ(kernel.written[0].can_id, 0x220u);
  EXPECT_EQ(kernel.written[0].can_dlc, 8);
  EXPECT_EQ(kernel.written[0].data[0], 0x80);
}

TEST(SocketCan, ExtendedAndRemoteFrames) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  kernel.put(raw(0x18DAF110 | CAN_EFF_FLAG, {1}));
  kernel.put(raw(0x123 | CAN_RTR_FLAG, {0, 0}));
  EXPECT_EQ(port.wait({.at = never}).items[0], (CanFrame{.id = 0x18DAF110, .extended = true, .size = 1, .data = {1}}));
  EXPECT_EQ(port.wait({.at = never}).items[0], (CanFrame{.id = 0x123, .remote = true, .size = 2}));
  const CanFrame extended{.id = 0x18DAF110, .extended = true, .remote = true};
  port.begin(sending(extended));
  EXPECT_EQ(kernel.written[0].can_id, 0x18DAF110 | CAN_EFF_FLAG | CAN_RTR_FLAG);
}

TEST(SocketCan, ReportsQueuedFramesBeforeTheRequest) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  kernel.put(raw(0x120, {1}));
  kernel.age = 5ms;
  const Time requested = port.now();
  port.begin(sending(request));
  const FrameEvent old = port.wait({.at = never});
  EXPECT_EQ(old.kind, EventKind::received);
  EXPECT_LT(old.at, requested);
  EXPECT_EQ(port.wait({.at = never}).kind, EventKind::sent);
}

TEST(SocketCan, SilenceTimerAndEnd) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  port.set_latency(1ms);
  port.begin(sending(request));
  const FrameEvent sent = port.wait({.at = never, .answer = 2ms});
  const FrameEvent silence = port.wait({.at = never, .answer = 2ms});
  EXPECT_EQ(silence.kind, EventKind::silence);
  EXPECT_GE(silence.at - sent.at, 3ms);
  const Time due = port.now() + 2ms;
  const FrameEvent timer = port.wait({.at = due, .answer = 1ms});
  EXPECT_EQ(timer.kind, EventKind::timer);
  EXPECT_GE(timer.at, due);
  port.set_end(now() + 1ms);
  EXPECT_THROW(static_cast<void>(port.wait({.at = never})), Ended);
}

TEST(SocketCan, WaitsForFullQueue) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  kernel.write_errors = {ENOBUFS, ENOBUFS, EAGAIN};
  port.begin(sending(request));
  EXPECT_EQ(kernel.written.size(), 1u);
  kernel.write_errors = {ENOBUFS};
  kernel.keep_last_error = true;
  const Failure full = failure_of([&] { port.begin(sending(request)); });
  EXPECT_EQ(full.kind(), Failure::Kind::lost);
  EXPECT_EQ(full.bus(), Failure::Bus::not_acknowledged);
  EXPECT_NE(std::string(full.what()).find("no other node acknowledges"), std::string::npos);
  EXPECT_NE(std::string(full.what()).find("120 ohms"), std::string::npos);
}

TEST(SocketCan, ErrorFrames) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  kernel.put(raw(CAN_ERR_FLAG | CAN_ERR_ACK, {0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(port.wait({.at = never}).kind, EventKind::line_error);
  kernel.put(raw(CAN_ERR_FLAG | CAN_ERR_BUSOFF, {0, 0, 0, 0, 0, 0, 0, 0}));
  const Failure off = failure_of([&] { static_cast<void>(port.wait({.at = never})); });
  EXPECT_EQ(off.kind(), Failure::Kind::lost);
  EXPECT_EQ(off.bus(), Failure::Bus::off);
  for (const char* words : {"bus-off", "ip link set can0 down", "restart-ms", "one number"}) {
    EXPECT_NE(std::string(off.what()).find(words), std::string::npos) << words;
  }
}

TEST(SocketCan, AnInterfaceThatGoesAway) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  kernel.put(raw(0x120, {1}));
  kernel.read_error = ENETDOWN;
  const Failure down = failure_of([&] { static_cast<void>(port.wait({.at = never})); });
  EXPECT_EQ(down.kind(), Failure::Kind::lost);
  EXPECT_NE(std::string(down.what()).find("can0 went down"), std::string::npos);
  kernel.read_error = 0;
  kernel.write_errors = {ENXIO};
  EXPECT_NE(std::string(failure_of([&] { port.begin(sending(request)); }).what()).find("unplugged"), std::string::npos);
}

TEST(SocketCan, DoesNotSetBitRate) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  // This rate equals the bit rate of the port's settings, so the port accepts it.
  port.begin({.kind = FrameStep::Kind::configure, .rate = line.rate});
  const Failure other = failure_of([&] { port.begin({.kind = FrameStep::Kind::configure, .rate = 500'000}); });
  EXPECT_EQ(other.kind(), Failure::Kind::unsupported);
  EXPECT_NE(std::string(other.what()).find("bitrate 500000"), std::string::npos);
  EXPECT_EQ(failure_of([&] { port.begin({.kind = FrameStep::Kind::pulse}); }).kind(), Failure::Kind::unsupported);
}

// Tests the read of a frame with the kernel's time stamp; uses a UDP socket, which every kernel has.
TEST(SocketCan, KernelStampIsTimeOfReception) {
  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  ASSERT_EQ(::bind(socket.get(), generic, size), 0);
  ASSERT_EQ(::getsockname(socket.get(), generic, &size), 0);
  const int on = 1;
  ASSERT_EQ(system_can_kernel().set(socket.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on), 0);
  const can_frame frame = raw(0x120, {1, 2});
  // The kernel stamps frames at their arrival only some time after the option is set; until then a stamp is the time
  // of the read.
  bool has_good_stamp = false;
  for (int attempt = 0; attempt < 100 && !has_good_stamp; ++attempt) {
    const StampClock stamps(read_clocks());
    const Time before = now();
    ASSERT_EQ(::sendto(socket.get(), &frame, sizeof frame, 0, generic, size), static_cast<ssize_t>(sizeof frame));
    const Time after = now();
    reach(after + 10ms);  // the frame waits in the socket's queue
    can_frame received{};
    std::optional<Time> stamp;
    const ClockPair before_read = read_clocks();
    ASSERT_EQ(system_can_kernel().read(socket.get(), received, stamp), static_cast<ssize_t>(sizeof frame));
    EXPECT_EQ(received.can_id, 0x120u);
    const StampedTime time = stamps.convert(stamp, before_read, read_clocks());
    // These limits hold for a stamp of the frame's arrival and also for a stamp of the read.
    EXPECT_GE(time.at, before);
    EXPECT_LE(time.at - time.late, after);
    has_good_stamp = stamp.has_value() && time.late < 1ms;
  }
  EXPECT_TRUE(has_good_stamp);
}

TEST(SocketCan, FrameHasTimeOfKernelStamp) {
  FakeCan kernel;
  SocketCan port("can0", line, kernel);
  kernel.put(raw(0x120, {1}));
  kernel.age = 3ms;
  const Time before = now();
  const FrameEvent event = port.wait({.at = never});
  const Time after = now();
  EXPECT_GE(event.at, before - 3ms);
  EXPECT_LE(event.at - event.late, after - 3ms);
  EXPECT_GT(event.late, Time{});
  // `late`, the uncertainty of the frame's time, is mostly below 1 us; 2 ms allows for a busy machine
  EXPECT_LT(event.late, 2ms);
}

TEST(SocketCan, FrameHasTimeOfReadAndItsUncertaintyIfClockWasSet) {
  for (const Time step : {Time(-1h), Time(-20us), Time(1ms), Time(1h)}) {
    FakeCan kernel;
    SocketCan port("can0", line, kernel);
    const Time opened = now();
    reach(opened + 5ms);
    kernel.put(raw(0x120, {1}));
    kernel.age = 3ms;
    // the calendar clock is set after the frame was stamped and before the port reads the clock again
    kernel.clock_step = step;
    const Time before = now();
    const FrameEvent event = port.wait({.at = never});
    EXPECT_GE(event.at, before) << step.count();
    EXPECT_LE(event.at - event.late, before - 3ms) << step.count();
    // Frames that arrive after the clock was set have exact times again.
    kernel.put(raw(0x120, {2}));
    EXPECT_LT(port.wait({.at = never}).late, 2ms) << step.count();
  }
}

TEST(SocketCan, FrameWithoutStampHasTimeOfRead) {
  FakeCan kernel;
  kernel.has_stamps = false;
  SocketCan port("can0", line, kernel);
  reach(now() + 5ms);
  kernel.put(raw(0x120, {1}));
  const Time before = now();
  const FrameEvent event = port.wait({.at = never});
  EXPECT_GE(event.at, before);
  EXPECT_GE(event.late, 5ms);
}

TEST(SocketCan, ListsInterfaces) {
  const TemporaryDirectory sys;
  for (const auto& [name, type] : {std::pair{"lo", 772}, std::pair{"vcan0", 280}, std::pair{"can0", 280}}) {
    std::filesystem::create_directory(sys.path() / name);
    std::ofstream(sys.path() / name / "type") << type << '\n';
  }
  EXPECT_EQ(can_interfaces(sys.path()), (std::vector<std::string>{"can0", "vcan0"}));
  EXPECT_TRUE(can_interfaces(sys.path() / "none").empty());
}

// The kernel of the test machine may have no CAN, so one of two errors is accepted.
TEST(SocketCan, RealKernelReportsMissingInterface) {
  const std::string what = failure_of([] { const SocketCan port("absenc-none", line); }).what();
  EXPECT_TRUE(what.find("there is no CAN interface absenc-none") != std::string::npos ||
              what.find("this kernel has no CAN") != std::string::npos)
      << what;
}

}  // namespace
}  // namespace absenc::os
