// SPDX-License-Identifier: Apache-2.0
// Tests which calls of Windows a serial port makes. The port is a named pipe; a replacement answers for its line.
#include "absenc/os/serial.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "absenc/os/signals.hpp"
#include "absenc/os/testing.hpp"
#include "absenc/os/windows/serial_calls.hpp"
#include "absenc/os/windows/text.hpp"
#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;

/// A line that has every rate up to `highest`, and logs what happens to RTS and DTR.
class FakeLine final : public SerialCalls {
 public:
  FakeLine() { set_serial_calls(this); }
  ~FakeLine() override { set_serial_calls(nullptr); }

  bool get_state(HANDLE, DCB& state) override {
    state = state_;
    return true;
  }
  bool set_state(HANDLE, const DCB& state) override {
    if (state.fRtsControl == RTS_CONTROL_TOGGLE && !toggles) return refuse();
    if (state.BaudRate > highest) return refuse();
    state_ = state;
    states.push_back(state);
    return true;
  }
  bool escape(HANDLE, DWORD function) override {
    if (!has_rts) return refuse();
    escapes.push_back(function);
    times.push_back(os::now());
    return true;
  }
  bool flush(HANDLE) override {
    ++flushes;
    on_flush();
    return true;
  }

  [[nodiscard]] const DCB& state() const { return state_; }
  bool toggles = true;
  bool has_rts = true;
  DWORD highest = 3'000'000;
  int flushes = 0;
  std::vector<DCB> states;
  std::vector<DWORD> escapes;
  std::vector<Time> times;  // of `escapes`
  std::function<void()> on_flush = [] {};

 private:
  static bool refuse() {
    ::SetLastError(ERROR_INVALID_PARAMETER);
    return false;
  }
  DCB state_ = [] {
    DCB state{};
    state.BaudRate = 1200;
    state.ByteSize = 7;
    state.fOutxCtsFlow = TRUE;
    return state;
  }();
};

/// A named pipe, whose other end the port opens.
class SerialPortTest : public ::testing::Test {
 protected:
  SerialPortTest() {
    static int count = 0;
    path = R"(\\.\pipe\absenc-test-)" + std::to_string(::GetCurrentProcessId()) + "-" + std::to_string(++count);
    server = Handle(::CreateNamedPipeW(utf16(path).c_str(), PIPE_ACCESS_DUPLEX, PIPE_TYPE_BYTE | PIPE_WAIT, 1, 4096,
                                       4096, 0, nullptr));
    EXPECT_TRUE(server);
  }
  [[nodiscard]] Data sent(std::size_t size) const {
    Data bytes(size);
    DWORD done = 0;
    EXPECT_TRUE(::ReadFile(server.get(), bytes.data(), static_cast<DWORD>(size), &done, nullptr));
    bytes.resize(done);
    return bytes;
  }

  FakeLine line;
  std::string path;
  Handle server;
};

constexpr LineSettings settings{.rate = 2'500'000};

TEST_F(SerialPortTest, SetsRawLineAndRestoresTheOldOne) {
  {
    const SerialPort port(path, {.rate = 115'200, .parity = Parity::even, .stop_bits = 2});
    EXPECT_EQ(line.state().BaudRate, 115'200u);
    EXPECT_EQ(line.state().ByteSize, 8);
    EXPECT_EQ(line.state().Parity, EVENPARITY);
    EXPECT_EQ(line.state().StopBits, TWOSTOPBITS);
    EXPECT_FALSE(line.state().fOutxCtsFlow);
    EXPECT_EQ(line.state().fRtsControl, RTS_CONTROL_ENABLE);
    EXPECT_EQ(line.state().fDtrControl, DTR_CONTROL_ENABLE);
    EXPECT_FALSE(port.kernel_direction());
  }
  EXPECT_EQ(line.state().BaudRate, 1200u);
  EXPECT_EQ(line.state().ByteSize, 7);
  EXPECT_TRUE(line.state().fOutxCtsFlow);
}

TEST_F(SerialPortTest, SwitchesTheDirectionByRtsOnRequest) {
  const SerialPort port(path, settings, Rs485::on);
  EXPECT_TRUE(port.kernel_direction());
  EXPECT_EQ(line.state().fRtsControl, RTS_CONTROL_TOGGLE);
  EXPECT_EQ(line.state().BaudRate, settings.rate);
}

TEST_F(SerialPortTest, KeepsTheDirectionWhenTheRateChanges) {
  SerialPort port(path, settings, Rs485::on);
  port.begin({.kind = ByteStep::Kind::configure, .rate = 9600});
  EXPECT_EQ(line.flushes, 1);  // the bytes before have left at the old rate
  EXPECT_EQ(line.state().BaudRate, 9600u);
  EXPECT_EQ(line.state().fRtsControl, RTS_CONTROL_TOGGLE);
}

TEST_F(SerialPortTest, RefusesDirectionWithoutHelpOfTheDriver) {
  line.toggles = false;
  const Failure failure = failure_of([&] { const SerialPort port(path, settings, Rs485::on); });
  EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
  EXPECT_NE(std::string(failure.what()).find("by RTS"), std::string::npos) << failure.what();
  EXPECT_EQ(line.state().BaudRate, 1200u);
}

TEST_F(SerialPortTest, SetsRtsUntilTheBytesHaveLeft) {
  SerialPort port(path, settings, Rs485::rts);
  EXPECT_EQ(line.state().fRtsControl, RTS_CONTROL_DISABLE);
  EXPECT_EQ(line.escapes, std::vector<DWORD>{CLRRTS});  // at rest
  EXPECT_FALSE(port.kernel_direction());
  const Data request{0x1A, 0x00, 0xFF};
  Data gone;
  line.on_flush = [&] {
    EXPECT_EQ(line.escapes.back(), DWORD{SETRTS});
    gone = sent(3);
  };
  port.begin(transfer(request));
  EXPECT_EQ(gone, request);
  EXPECT_EQ(line.escapes, (std::vector<DWORD>{CLRRTS, SETRTS, CLRRTS}));
  const ByteEvent event = port.wait({});
  EXPECT_EQ(event.kind, ByteEvent::Kind::sent);
  EXPECT_LE(event.at, port.now());  // when the direction has changed, nothing is under way
}

constexpr LineSettings slow{.rate = 300};  // a character takes 33 ms

TEST_F(SerialPortTest, HoldsRtsWhileTheAdapterMaySend) {
  SerialPort port(path, slow, Rs485::rts);
  const Data request{1, 2, 3};
  port.begin(transfer(request));  // the driver is done at once
  EXPECT_GE(line.times.back() - line.times[1], 3 * port.character_time());
}

TEST_F(SerialPortTest, ReleasesRtsAtOnceIfTheDriverHasWaited) {
  SerialPort port(path, slow, Rs485::rts);
  const Data request{1, 2, 3};
  Time done{};
  line.on_flush = [&] {
    os::reach(os::now() + 3 * port.character_time());
    done = os::now();
  };
  port.begin(transfer(request));
  EXPECT_LT(line.times.back() - done, 3 * port.character_time());
}

TEST_F(SerialPortTest, ReleasesRtsWhenSendingFails) {
  SerialPort port(path, settings, Rs485::rts);
  server = Handle();
  const Data request{1};
  EXPECT_EQ(failure_of([&] { port.begin(transfer(request)); }).kind(), Failure::Kind::lost);
  EXPECT_EQ(line.escapes, (std::vector<DWORD>{CLRRTS, SETRTS, CLRRTS}));
}

TEST_F(SerialPortTest, KeepsRtsClearWhenTheRateChanges) {
  SerialPort port(path, settings, Rs485::rts);
  port.begin({.kind = ByteStep::Kind::configure, .rate = 9600});
  EXPECT_EQ(line.state().fRtsControl, RTS_CONTROL_DISABLE);
}

TEST_F(SerialPortTest, RefusesDirectionWithoutRts) {
  line.has_rts = false;
  const Failure failure = failure_of([&] { const SerialPort port(path, settings, Rs485::rts); });
  EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
  EXPECT_NE(std::string(failure.what()).find("no RTS line"), std::string::npos) << failure.what();
}

TEST_F(SerialPortTest, RefusesRateThatTheDriverDoesNotHave) {
  const Failure failure = failure_of([&] { const SerialPort port(path, {.rate = 10'000'000}); });
  EXPECT_EQ(failure.kind(), Failure::Kind::bad_rate);
  EXPECT_NE(std::string(failure.what()).find("stays at 1200"), std::string::npos) << failure.what();
}

TEST_F(SerialPortTest, RefusesCharactersThatNoUartHas) {
  const Failure failure = failure_of([&] { const SerialPort port(path, {.rate = 9600, .data_bits = 16}); });
  EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
}

TEST_F(SerialPortTest, ReceivesWithRtsReleased) {
  const SerialPort port(path, settings, Rs485::off, {}, system_wires(), SerialUse::receive);
  EXPECT_EQ(line.escapes, std::vector<DWORD>{CLRRTS});
}

TEST_F(SerialPortTest, SendsPulsesOnRtsAndDtr) {
  SerialPort port(path, settings, Rs485::automatic,
                  {.trigger = {.kind = PulseWire::Kind::rts}, .clear = {.kind = PulseWire::Kind::dtr}});
  EXPECT_EQ(line.escapes, (std::vector<DWORD>{CLRRTS, CLRDTR}));  // at rest
  line.escapes.clear();
  port.begin({.kind = ByteStep::Kind::pulse, .wire = ExtraWire::trigger, .width = 10us});
  EXPECT_EQ(line.escapes, (std::vector<DWORD>{SETRTS, CLRRTS}));
}

TEST_F(SerialPortTest, CarriesBytesBothWays) {
  SerialPort port(path, settings);
  const Data request{0x1A, 0x00, 0xFF};
  port.begin(transfer(request));
  EXPECT_EQ(sent(3), request);
  DWORD done = 0;
  ASSERT_TRUE(::WriteFile(server.get(), request.data(), 3, &done, nullptr));
  Data received;
  const ByteStep wait{.kind = ByteStep::Kind::wait, .at = port.now() + 5s};
  while (received.size() < 3) {
    const ByteEvent event = port.wait(wait);
    ASSERT_NE(event.kind, ByteEvent::Kind::timer);
    if (event.kind == ByteEvent::Kind::received)
      received.insert(received.end(), event.items.begin(), event.items.end());
  }
  EXPECT_EQ(received, request);
}

TEST_F(SerialPortTest, ReportsPortThatWentAway) {
  SerialPort port(path, settings);
  server = Handle();
  const Failure failure =
      failure_of([&] { static_cast<void>(port.wait({.kind = ByteStep::Kind::wait, .at = port.now() + 5s})); });
  EXPECT_EQ(failure.kind(), Failure::Kind::lost) << failure.what();
}

TEST_F(SerialPortTest, SecondProgramIsToldThatThePortIsInUse) {
  const SerialPort port(path, settings);
  const Failure failure = open_failure("COM5", EACCES);
  EXPECT_EQ(failure.kind(), Failure::Kind::in_use);
  EXPECT_EQ(open_failure("COM5", EBUSY).kind(), Failure::Kind::in_use);
}

TEST(SerialPorts, NamesArePortsFrom1To256) {
  EXPECT_EQ(port_named("COM5"), "COM5");
  EXPECT_EQ(port_named("com256"), "COM256");
  for (const char* name : {"", "COM", "COM0", "COM257", "COM5x", "LPT1", "COM-1", "elbow"}) {
    EXPECT_EQ(port_named(name), "") << name;
  }
}

}  // namespace
}  // namespace absenc::os
