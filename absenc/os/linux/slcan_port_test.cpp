// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/slcan_port.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "absenc/host/drive.hpp"
#include "absenc/os/emulator_port.hpp"
#include "absenc/os/linux/testing.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using FrameStep = Step<CanFrame>;
using FrameEvent = Event<CanFrame>;
using EventKind = FrameEvent::Kind;

constexpr LineSettings bus{.rate = 250'000};
const CanFrame position{.id = 0x120, .size = 8, .data = {0x47, 0x26}};
const CanFrame request{.id = 0x220, .size = 8, .data = {0x80, 0x20}};

FrameStep sending(const CanFrame& frame) { return {.kind = FrameStep::Kind::transfer, .out = {&frame, 1}}; }

/// A byte port in memory that replies to commands as a CAN adapter does.
class FakeAdapter final : public Port<std::uint8_t> {
 public:
  Time now() override { return os::now(); }
  void begin(const ByteStep& step) override {
    const std::string text(step.out.begin(), step.out.end());
    written += text;
    for (const auto& [command, answer] : replies) {
      if (text == command) coming += answer;
    }
  }
  ByteEvent wait(const ByteStep& step) override {
    if (!coming.empty()) {
      given.assign(coming.begin(), coming.end());
      coming.clear();
      return {.kind = ByteEvent::Kind::received, .at = os::now(), .items = given};
    }
    if (step.at == never) throw std::logic_error("a wait without end");
    os::sleep_until(step.at);
    return {.kind = ByteEvent::Kind::timer, .at = os::now()};
  }
  std::string written;
  std::string coming;
  std::vector<std::pair<std::string, std::string>> replies{
      {"C\r", "\a"}, {"S5\r", "\r"}, {"S6\r", "\r"}, {"O\r", "\r"}};

 private:
  Data given;
};

TEST(SlcanPort, OpensTheAdapterAndClosesIt) {
  const auto adapter = std::make_shared<FakeAdapter>();
  { const SlcanPort port(adapter, "X", bus); }
  EXPECT_EQ(adapter->written, "\r\r\rC\rS5\rO\rC\r");
}

TEST(SlcanPort, ReportsRefusalOfAdapter) {
  const auto adapter = std::make_shared<FakeAdapter>();
  const auto refusal = [&](const LineSettings& settings) {
    return failure_of([&] { const SlcanPort port(adapter, "/dev/ttyACM9", settings); });
  };
  EXPECT_EQ(refusal({.rate = 123}).kind(), Failure::Kind::bad_rate);
  adapter->replies = {{"S5\r", "\a"}};
  EXPECT_NE(std::string(refusal(bus).what()).find("refused a bit rate of 250000 bit/s (S5)"), std::string::npos);
  adapter->replies = {{"S5\r", "\r"}, {"O\r", "\a"}};
  EXPECT_NE(std::string(refusal(bus).what()).find("refused to open"), std::string::npos);
}

TEST(SlcanPort, NotesAnAdapterThatAcknowledgesNothing) {
  const auto silent = std::make_shared<FakeAdapter>();
  silent->replies.clear();
  EXPECT_EQ(SlcanPort(silent, "X", bus).notes().size(), 1u);
  EXPECT_TRUE(SlcanPort(std::make_shared<FakeAdapter>(), "X", bus).notes().empty());
}

TEST(SlcanPort, FramesGarbageAndRefusals) {
  const auto adapter = std::make_shared<FakeAdapter>();
  SlcanPort port(adapter, "X", bus);
  adapter->written.clear();
  port.begin(sending(request));
  EXPECT_EQ(adapter->written, "t22088020000000000000\r");
  adapter->coming = "z\rxxt12t12084726000000000000\rV1013\r\aT18DAF110101ABCD\r";
  EXPECT_EQ(port.wait({.at = never}).kind, EventKind::sent);
  EXPECT_EQ(port.wait({.at = never}).items[0], position);
  EXPECT_EQ(port.wait({.at = never}).kind, EventKind::line_error);
  const FrameEvent last = port.wait({.at = never});
  EXPECT_EQ(last.items[0], (CanFrame{.id = 0x18DAF110, .extended = true, .size = 1, .data = {1}}));
}

TEST(SlcanPort, ReportsQueuedFramesBeforeTheRequest) {
  const auto adapter = std::make_shared<FakeAdapter>();
  SlcanPort port(adapter, "X", bus);
  adapter->coming = "t12084726000000000000\r";
  port.begin(sending(request));
  EXPECT_EQ(port.wait({.at = never}).kind, EventKind::received);
  EXPECT_EQ(port.wait({.at = never}).kind, EventKind::sent);
}

TEST(SlcanPort, AcknowledgementsAreNoFrames) {
  const auto adapter = std::make_shared<FakeAdapter>();
  SlcanPort port(adapter, "X", bus);
  port.begin(sending(request));
  EXPECT_EQ(port.wait({.at = never}).kind, EventKind::sent);
  adapter->coming = "z\r";
  EXPECT_EQ(port.wait({.at = never, .answer = 5ms}).kind, EventKind::silence);
}

TEST(SlcanPort, ChangesItsBitRate) {
  const auto adapter = std::make_shared<FakeAdapter>();
  SlcanPort port(adapter, "X", bus);
  adapter->written.clear();
  port.begin({.kind = FrameStep::Kind::configure, .rate = 500'000});
  EXPECT_EQ(adapter->written, "C\rS6\rO\r");
}

/// The simulated adapter; the test acts as its host.
struct Adapter : ::testing::Test {
  std::shared_ptr<FakeAdapter> host = std::make_shared<FakeAdapter>();
  SlcanAdapter port{host, bus};

  std::string send_text(const std::string& text) {
    host->replies.clear();
    host->written.clear();
    host->coming = text;
    received.clear();
    const Time until = os::now() + 1ms;
    for (;;) {
      const FrameEvent event = port.wait({.at = until});
      if (event.kind == EventKind::timer) return host->written;
      if (event.kind == EventKind::received) received.push_back(event.items[0]);
    }
  }
  std::vector<CanFrame> received;
};

TEST_F(Adapter, AnswersLikeAdapters) {
  EXPECT_EQ(send_text("\r\r"), "\r\r");
  EXPECT_EQ(send_text("O\r"), "\a");  // the adapter refuses to open, because no bit rate is set yet
  EXPECT_EQ(send_text("S5\r"), "\r");
  EXPECT_EQ(send_text("S9\r"), "\a");
  EXPECT_EQ(send_text("C\r"), "\a");
  EXPECT_EQ(send_text("t1200\r"), "\a");
  EXPECT_EQ(send_text("V\rN\r"), "V1013\rN0001\r");
  EXPECT_EQ(send_text("F\r"), "\a");
  EXPECT_EQ(send_text("M00000000\rmFFFFFFFF\r"), "\r\r");
  EXPECT_EQ(send_text("O\r"), "\r");
  EXPECT_EQ(send_text("S6\r"), "\a");
  EXPECT_EQ(send_text("F\r"), "F00\r");
  EXPECT_EQ(send_text("t22088020000000000000\r"), "z\r");
  EXPECT_EQ(received, std::vector<CanFrame>{request});
  EXPECT_EQ(send_text("T000002208\r"), "\a");  // the adapter refuses the frame, because its 8 data bytes are missing
  EXPECT_EQ(send_text("T000002200\r"), "Z\r");
  EXPECT_EQ(send_text("r2208\r"), "z\r");
  EXPECT_TRUE(received[0].remote);
  EXPECT_EQ(send_text("what\r"), "\a");
  EXPECT_EQ(send_text("C\r"), "\r");
  EXPECT_EQ(port.garbage(), 3u);
}

TEST_F(Adapter, SendsOnlyWhileItIsOpen) {
  port.begin(sending(position));
  EXPECT_EQ(host->written, "");
  send_text("S5\rO\r");
  port.begin(sending(position));
  EXPECT_EQ(host->written, "\r\rt12084726000000000000\r");
  send_text("C\rZ1\rO\r");
  port.begin(sending(position));
  EXPECT_EQ(host->written.size(), std::string("\r\r\rt120847260000000000001234\r").size());
  EXPECT_EQ(port.lost(), 1u);
}

TEST_F(Adapter, NothingPassesAtAnotherBitRate) {
  send_text("S6\rO\r");
  port.begin(sending(position));
  EXPECT_EQ(host->written, "\r\r");
  EXPECT_EQ(send_text("t22088020000000000000\r"), "z\r");
  EXPECT_TRUE(received.empty());
  port.begin({.kind = FrameStep::Kind::configure, .rate = 500'000});
  send_text("t22088020000000000000\r");
  EXPECT_EQ(received.size(), 1u);
  EXPECT_EQ(port.lost(), 2u);
}

constexpr Time frame_time = 111 * 4us;  // time of a frame on the bus: (47 + 8 * 8) bits at 250 kbit/s

TEST_F(Adapter, FramesSentAtOnceComeOneAfterTheOther) {
  send_text("S5\rO\r");
  const Time before = os::now();
  host->coming = "t22088020000000000000\rt22088020000000000000\rt22088020000000000000\r";
  std::vector<Time> times;
  while (times.size() < 3) {
    const FrameEvent event = port.wait({.at = before + 60s});
    ASSERT_EQ(event.kind, EventKind::received);
    times.push_back(event.at);
  }
  EXPECT_GE(times[0] - before, frame_time);
  EXPECT_EQ(times[1] - times[0], frame_time);
  EXPECT_EQ(times[2] - times[1], frame_time);
}

TEST_F(Adapter, RefusesAndCountsFramesBeyondItsQueue) {
  send_text("S5\rO\r");
  std::string all;
  for (unsigned i = 0; i < 100; ++i) all += "t22088020000000000000\r";
  const std::string replies = send_text(all);
  EXPECT_EQ(std::count(replies.begin(), replies.end(), 'z'), 64);
  EXPECT_EQ(std::count(replies.begin(), replies.end(), '\a'), 36);
  EXPECT_EQ(port.overflowed(), 36u);
}

TEST_F(Adapter, ListensOnly) {
  send_text("S5\rL\r");
  EXPECT_EQ(send_text("t22088020000000000000\r"), "\a");
  port.begin(sending(position));
  EXPECT_NE(host->written.find("t1208"), std::string::npos);
}

// Runs SlcanPort and SlcanAdapter over a real pseudo-terminal, each in its own thread.
TEST(Slcan, BothEndsOfAPseudoTerminal) {
  const auto terminal = std::make_shared<EmulatorPort>();
  terminal->set_end(now() + 60s);
  std::thread device([&] {
    SlcanAdapter port(terminal, bus);
    struct Echo final : Machine<CanFrame> {
      void feed(const FrameEvent& event) override {
        if (event.kind == EventKind::sent) over = true;
        if (event.kind != EventKind::received) return;
        due = true;
      }
      FrameStep next(Time) override {
        if (over) return {.kind = FrameStep::Kind::done};
        if (!std::exchange(due, false)) return {.at = never};
        return sending(position);
      }
      bool due = false;
      bool over = false;
    } echo;
    host::drive(echo, port, [] { return true; });
  });
  {
    const auto serial = std::make_shared<SerialPort>(terminal->path(), LineSettings{.rate = 115'200}, Rs485::off);
    SlcanPort port(serial, terminal->path(), bus);
    EXPECT_TRUE(port.notes().empty());
    port.begin(sending(request));
    EXPECT_EQ(port.wait({.at = never, .answer = 30s}).kind, EventKind::sent);
    const FrameEvent answer = port.wait({.at = never, .answer = 30s});
    ASSERT_EQ(answer.kind, EventKind::received);
    EXPECT_EQ(answer.items[0], position);
  }
  device.join();
}

}  // namespace
}  // namespace absenc::os
