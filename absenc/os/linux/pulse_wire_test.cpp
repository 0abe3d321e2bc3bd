// SPDX-License-Identifier: Apache-2.0
// Tests requests for RTS, DTR and GPIO lines, mostly with a test replacement of the kernel.
#include "absenc/os/pulse_wire.hpp"

#include <gtest/gtest.h>

#include <cerrno>

#include "absenc/os/gpio.hpp"
#include "absenc/os/linux/testing.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using Wire = PulseWire::Kind;
using Log = std::vector<std::string>;

/// A kernel with one GPIO line, "CLK", and modem lines; it logs requests and can refuse them.
class FakeWires final : public WireKernel {
 public:
  int set_modem_line(int, ModemLine line, bool set) override {
    if (modem_error != 0) return fail(modem_error);
    log.push_back(std::string(line == ModemLine::rts ? "RTS " : "DTR ") + (set ? "set" : "cleared"));
    times.push_back(os::now());
    return 0;
  }
  gpiod_line* find_gpio(const std::string& name) override {
    if (name == "CLK" && find_error == 0) return line();
    errno = find_error != 0 ? find_error : ENOENT;
    return nullptr;
  }
  int request_gpio(gpiod_line* which, bool active_low) override {
    EXPECT_EQ(which, line());
    if (request_error != 0) return fail(request_error);
    log.push_back(active_low ? "output, active low" : "output, active high");
    return 0;
  }
  int set_gpio(gpiod_line* which, int value) override {
    EXPECT_EQ(which, line());
    if (set_error != 0) return fail(set_error);
    log.push_back("value " + std::to_string(value));
    times.push_back(os::now());
    return 0;
  }
  void release_gpio(gpiod_line* which) override {
    EXPECT_EQ(which, line());
    log.push_back("released");
  }

  int modem_error = 0;
  int find_error = 0;
  int request_error = 0;
  int set_error = 0;
  Log log;
  std::vector<Time> times;

 private:
  gpiod_line* line() { return reinterpret_cast<gpiod_line*>(this); }
  static int fail(int error) {
    errno = error;
    return -1;
  }
};

constexpr LineSettings settings{.rate = 9600};
constexpr ByteStep trigger{.kind = ByteStep::Kind::pulse, .wire = ExtraWire::trigger, .width = 10us};
constexpr ByteStep clear_step{.kind = ByteStep::Kind::pulse, .wire = ExtraWire::clear, .width = 10us};

class PulseWireTest : public ::testing::Test {
 protected:
  Failure refused(const PulseWires& wires, Rs485 rs485 = Rs485::automatic) {
    return failure_of([&] { const SerialPort port(terminal.path, settings, rs485, wires, kernel); });
  }
  PseudoTerminal terminal;
  FakeWires kernel;
};

TEST_F(PulseWireTest, IsLowForThePulseAndHighAtRest) {
  {
    SerialPort port(terminal.path, settings, Rs485::automatic,
                    {.trigger = {.kind = Wire::rts}, .clear = {.kind = Wire::dtr}}, kernel);
    EXPECT_EQ(kernel.log, (Log{"RTS cleared", "DTR cleared"})) << "opening the port had set both";
    port.begin(trigger);
    EXPECT_EQ(port.wait({}).kind, ByteEvent::Kind::sent);
    port.begin(clear_step);
  }
  EXPECT_EQ(kernel.log, (Log{"RTS cleared", "DTR cleared", "RTS set", "RTS cleared", "DTR set", "DTR cleared"}));
}

TEST_F(PulseWireTest, IsHighForThePulseIfActiveHigh) {
  SerialPort port(terminal.path, settings, Rs485::automatic, {.trigger = {.kind = Wire::dtr, .active_high = true}},
                  kernel);
  port.begin(trigger);
  EXPECT_EQ(kernel.log, (Log{"DTR set", "DTR cleared", "DTR set"}));
}

TEST_F(PulseWireTest, UsesPulseWidthOfUser) {
  SerialPort port(terminal.path, settings, Rs485::automatic, {.trigger = {.kind = Wire::rts, .width = 3ms}}, kernel);
  port.begin(trigger);
  ASSERT_EQ(kernel.times.size(), 3u);
  EXPECT_GE(kernel.times[2] - kernel.times[1], 3ms);
}

TEST_F(PulseWireTest, DrivesGpioLine) {
  for (const bool high : {false, true}) {
    kernel.log.clear();
    {
      SerialPort port(terminal.path, settings, Rs485::automatic,
                      {.trigger = {.kind = Wire::gpio, .name = "CLK", .active_high = high}}, kernel);
      port.begin(trigger);
    }
    EXPECT_EQ(kernel.log, (Log{high ? "output, active high" : "output, active low", "value 1", "value 0", "released"}));
  }
}

TEST_F(PulseWireTest, ReportsGpioErrors) {
  const PulseWires clk{.clear = {.kind = Wire::gpio, .name = "CLK"}};
  const Failure unknown = refused({.clear = {.kind = Wire::gpio, .name = "CLR"}});
  EXPECT_EQ(unknown.kind(), Failure::Kind::not_found);
  EXPECT_STREQ(unknown.what(), "no GPIO line of this machine is named CLR: `gpioinfo` lists the names");
  kernel.find_error = EACCES;
  EXPECT_EQ(refused(clk).kind(), Failure::Kind::no_permission);
  kernel.find_error = 0;
  kernel.request_error = EBUSY;
  EXPECT_EQ(refused(clk).kind(), Failure::Kind::in_use);
  EXPECT_EQ(kernel.log, Log{"released"});
  kernel.request_error = 0;
  SerialPort port(terminal.path, settings, Rs485::automatic, clk, kernel);
  kernel.set_error = EIO;
  EXPECT_EQ(failure_of([&] { port.begin(clear_step); }).kind(), Failure::Kind::system);
}

TEST_F(PulseWireTest, ReportsMissingWire) {
  kernel.modem_error = ENOTTY;
  const Failure failure = refused({.trigger = {.kind = Wire::rts}});
  EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
  EXPECT_NE(std::string(failure.what()).find("has no RTS line for the pulse"), std::string::npos);
}

TEST_F(PulseWireTest, RefusesPulseWithoutWire) {
  SerialPort port(terminal.path, settings, Rs485::automatic, {.trigger = {.kind = Wire::rts}}, kernel);
  const Failure failure = failure_of([&] { port.begin(clear_step); });
  EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
  EXPECT_STREQ(failure.what(),
               "nothing says which wire carries the pulse: set clear=rts, clear=dtr or clear=gpio:NAME");
}

TEST_F(PulseWireTest, RtsHasOneUseOnly) {
  for (const Rs485 rs485 : {Rs485::on, Rs485::rts}) {
    const Failure failure = refused({.clear = {.kind = Wire::rts}}, rs485);
    EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
    EXPECT_NE(std::string(failure.what()).find("use DTR or a GPIO line"), std::string::npos);
  }
}

TEST_F(PulseWireTest, RtsSwitchesTheDirection) {
  SerialPort port(terminal.path, settings, Rs485::rts, {}, kernel);
  EXPECT_EQ(kernel.log, Log{"RTS cleared"});
  const Data request{1, 2, 3};
  port.begin(transfer(request));
  EXPECT_EQ(kernel.log, (Log{"RTS cleared", "RTS set", "RTS cleared"}));
  EXPECT_EQ(get(terminal.master.get()), request);
  kernel.modem_error = EIO;
  EXPECT_EQ(failure_of([&] { port.begin(transfer(request)); }).kind(), Failure::Kind::lost);
  EXPECT_EQ(get(terminal.master.get(), 0), Data{}) << "nothing may be sent against another sender";
}

TEST_F(PulseWireTest, RtsOfAPortWithoutItSwitchesNothing) {
  kernel.modem_error = ENOTTY;
  const Failure failure = refused({}, Rs485::rts);
  EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
  EXPECT_NE(std::string(failure.what()).find("no RTS line"), std::string::npos);
}

// Tests the real system calls as far as possible without a wire.
TEST(SystemWires, ReportPseudoTerminalWithoutWires) {
  const PseudoTerminal terminal;
  for (const Wire wire : {Wire::rts, Wire::dtr}) {
    const Failure failure = failure_of(
        [&] { const SerialPort port(terminal.path, settings, Rs485::automatic, {.trigger = {.kind = wire}}); });
    EXPECT_EQ(failure.kind(), Failure::Kind::unsupported) << failure.what();
  }
  const Failure failure = failure_of([&] {
    const SerialPort port(terminal.path, settings, Rs485::automatic,
                          {.trigger = {.kind = Wire::gpio, .name = "absenc-no-such-line"}});
  });
  EXPECT_TRUE(failure.kind() == Failure::Kind::not_found || failure.kind() == Failure::Kind::no_permission);
}

TEST(SystemWires, RecognisePseudoTerminalByPath) {
  const PseudoTerminal terminal;
  EXPECT_TRUE(is_pseudo_terminal(terminal.path));
  EXPECT_FALSE(is_pseudo_terminal("/dev/null"));
  EXPECT_FALSE(is_pseudo_terminal("/dev/no-such-port"));
}

}  // namespace
}  // namespace absenc::os
