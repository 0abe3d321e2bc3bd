// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/serial.hpp"

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <termios.h>

#include <cstring>
#include <fstream>

#include "absenc/os/linux/testing.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using Kind = Failure::Kind;

constexpr LineSettings fast{.rate = 2'500'000};

bool contains(const Failure& failure, std::string_view part) {
  return std::string_view(failure.what()).find(part) != std::string_view::npos;
}

// Returns the bit rate in `state`: the last field of struct termios2.
std::uint32_t rate_of(const TerminalState& state) {
  std::uint32_t rate = 0;
  std::memcpy(&rate, state.data() + state.size() - sizeof rate, sizeof rate);
  return rate;
}

static_assert(rates_agree(1'000'000, 1'010'000) && rates_agree(1'000'000, 990'000));
static_assert(!rates_agree(1'000'000, 1'010'001) && !rates_agree(1'000'000, 989'999));
static_assert(!rates_agree(2'500'000, 9600) && !rates_agree(9600, 0) && rates_agree(4'000'000'000, 4'000'000'000));

static_assert(nearest_rate(2'500'000, 9600, 0) == 9600);
static_assert(nearest_rate(2'500'000, 9600, 115'200) == 115'200, "above the fastest");
static_assert(nearest_rate(2'500'000, 9600, 3'000'000) == 3'000'000, "divided by 1");
static_assert(nearest_rate(2'500'000, 9600, 4'000'000) == 2'000'000, "divided by 2");
static_assert(nearest_rate(2'500'000, 2'400'000, 3'000'000) == 2'400'000, "the driver does better");
static_assert(nearest_rate(2'500'000, 9600, 5'000'000) == 9600, "the driver has just refused 2.5 MBd");

TEST(SerialPort, SetsAnyRateAndRestoresSettings) {
  const PseudoTerminal terminal;
  // A master has no settings of its own: `terminal_state` returns those of the slave.
  const auto before = terminal_state(terminal.master.get());
  ASSERT_TRUE(before);
  {
    const SerialPort port(terminal.path, fast);
    EXPECT_EQ(rate_of(*terminal_state(terminal.master.get())), 2'500'000u);
    EXPECT_EQ(port.latency(), 20ms);
    EXPECT_TRUE(port.notes().empty());
    EXPECT_FALSE(port.kernel_direction());
  }
  EXPECT_EQ(terminal_state(terminal.master.get()), before);
}

TEST(SerialPort, ChangesTheRate) {
  const PseudoTerminal terminal;
  SerialPort port(terminal.path, fast);
  port.begin({.kind = ByteStep::Kind::configure, .rate = 123'456});
  EXPECT_EQ(rate_of(*terminal_state(terminal.master.get())), 123'456u);
  const auto zero = [&] { port.begin({.kind = ByteStep::Kind::configure}); };
  EXPECT_EQ(failure_of(zero).kind(), Kind::bad_rate);
}

// A pseudo-terminal clears the parity flag, but leaves the odd-parity and stop-bit flags.
TEST(SerialPort, AChangeOfTheRateLeavesParityAndStopBits) {
  const PseudoTerminal terminal;
  SerialPort port(terminal.path, {.rate = 19'200, .parity = Parity::odd, .stop_bits = 2});
  const auto flags = [&] {
    termios state{};
    EXPECT_EQ(::tcgetattr(terminal.master.get(), &state), 0);
    return state.c_cflag & (PARODD | CSTOPB);
  };
  ASSERT_EQ(flags(), static_cast<tcflag_t>(PARODD | CSTOPB));
  port.begin({.kind = ByteStep::Kind::configure, .rate = 9600});
  EXPECT_EQ(rate_of(*terminal_state(terminal.master.get())), 9600u);
  EXPECT_EQ(flags(), static_cast<tcflag_t>(PARODD | CSTOPB));
}

TEST(SerialPort, CarriesEveryByteUnchanged) {
  const PseudoTerminal terminal;
  Data all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  const Descriptor slave(::open(terminal.path.c_str(), O_RDWR | O_NOCTTY));
  set_terminal(slave.get(), fast);
  put(terminal.master.get(), {0x55});  // a byte received before the port is opened must be discarded
  pollfd readable{slave.get(), POLLIN, 0};
  ASSERT_EQ(::poll(&readable, 1, 5000), 1);
  SerialPort port(terminal.path, fast);
  port.begin(transfer(all));
  Data got;
  while (got.size() < all.size()) {
    const Data part = get(terminal.master.get());
    ASSERT_FALSE(part.empty());
    got.insert(got.end(), part.begin(), part.end());
  }
  EXPECT_EQ(got, all);
  put(terminal.master.get(), all);
  EXPECT_EQ(port.wait({}).kind, ByteEvent::Kind::sent);
  got.clear();
  while (got.size() < all.size()) {
    const ByteEvent event = port.wait({.at = never, .answer = 5s, .gap = 5s});
    ASSERT_EQ(event.kind, ByteEvent::Kind::received);
    got.insert(got.end(), event.items.begin(), event.items.end());
  }
  EXPECT_EQ(got, all);
  EXPECT_EQ(get(terminal.master.get(), 0), Data{});  // the port sends no echo
}

TEST(SerialPort, IsLostWithItsOtherSide) {
  PseudoTerminal terminal;
  SerialPort port(terminal.path, fast);
  terminal.master.close();
  const Failure failure = failure_of([&] { static_cast<void>(port.wait({.at = never})); });
  EXPECT_EQ(failure.kind(), Kind::lost);
  EXPECT_TRUE(contains(failure, "the port " + terminal.path + " went away")) << failure.what();
  const Data bytes{1};
  EXPECT_EQ(failure_of([&] { port.begin(transfer(bytes)); }).kind(), Kind::lost);
}

TEST(SerialPort, IsForOneProgramAtATime) {
  const PseudoTerminal terminal;
  {
    const SerialPort port(terminal.path, fast);
    const Failure failure = failure_of([&] { const SerialPort second(terminal.path, {.rate = 9600}); });
    EXPECT_EQ(failure.kind(), Kind::in_use);
    EXPECT_TRUE(contains(failure, "(process " + std::to_string(::getpid()) + ")")) << failure.what();
    EXPECT_EQ(rate_of(*terminal_state(terminal.master.get())), fast.rate);
  }
  int exclusive = 1;
  const Descriptor slave(::open(terminal.path.c_str(), O_RDWR | O_NOCTTY));
  ASSERT_EQ(::ioctl(slave.get(), TIOCGEXCL, &exclusive), 0);
  EXPECT_EQ(exclusive, 0);
  const SerialPort third(terminal.path, fast);
}

TEST(SerialPort, NamesThePortsThatExist) {
  const Failure failure = failure_of([] { const SerialPort port("/dev/ttyNONE0", fast); });
  EXPECT_EQ(failure.kind(), Kind::not_found);
  EXPECT_TRUE(contains(failure, "there is no port /dev/ttyNONE0")) << failure.what();
  for (const std::string& port : serial_ports()) EXPECT_TRUE(contains(failure, port)) << failure.what();
}

TEST(SerialPort, RefusesFilesThatAreNoTerminal) {
  for (const char* path : {"/dev/null", "/tmp"}) {
    EXPECT_EQ(failure_of([&] { const SerialPort port(path, fast); }).kind(), Kind::unsupported) << path;
  }
}

TEST(SerialPort, ReportsPseudoTerminalWithoutWires) {
  const PseudoTerminal terminal;
  SerialPort port(terminal.path, fast);
  EXPECT_EQ(failure_of([&] { port.begin({.kind = ByteStep::Kind::pulse}); }).kind(), Kind::unsupported);
  const PseudoTerminal second;
  EXPECT_EQ(failure_of([&] { const SerialPort other(second.path, fast, Rs485::on); }).kind(), Kind::unsupported);
}

// Opens `path` as an ordinary user in a child process; the message must contain `part`.
void expect_no_permission(const std::string& path, const std::string& part) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (::geteuid() == 0 && (::setgroups(0, nullptr) < 0 || ::setgid(65534) < 0 || ::setuid(65534) < 0)) ::_exit(3);
    try {
      const SerialPort port(path, fast);
    } catch (const Failure& failure) {
      ::_exit(failure.kind() == Kind::no_permission && contains(failure, part) ? 0 : 1);
    }
    ::_exit(2);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(SerialPort, ReportsNeededPermission) {
  const PseudoTerminal terminal;
  const bool root = ::geteuid() == 0;
  ASSERT_EQ(::chmod(terminal.path.c_str(), root ? 0600 : 0000), 0);
  expect_no_permission(terminal.path, "which only its owner ");
  const group* dialout = ::getgrnam("dialout");
  if (!root || dialout == nullptr) GTEST_SKIP() << "only root can give the port to the group dialout";
  ASSERT_EQ(::chown(terminal.path.c_str(), 0, dialout->gr_gid), 0);
  ASSERT_EQ(::chmod(terminal.path.c_str(), 0660), 0);
  expect_no_permission(terminal.path, "sudo usermod -aG dialout $USER");
}

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

TEST(SerialPorts, AreTheTerminalsWithHardware) {
  const TemporaryDirectory sys;
  write_file(sys.path() / "ttyUSB1" / "device" / "latency_timer", "16\n");
  write_file(sys.path() / "ttyACM0" / "device" / "x", "");
  write_file(sys.path() / "ttyS0" / "device" / "x", "");
  write_file(sys.path() / "ttyS0" / "type", "4\n");
  write_file(sys.path() / "ttyS1" / "device" / "x", "");
  write_file(sys.path() / "ttyS1" / "type", "0\n");
  write_file(sys.path() / "tty1" / "x", "");
  EXPECT_EQ(serial_ports(sys.path()), (std::vector<std::string>{"/dev/ttyACM0", "/dev/ttyS0", "/dev/ttyUSB1"}));
  EXPECT_EQ(latency_timer("ttyUSB1", sys.path()), 16u);
  EXPECT_EQ(latency_timer("ttyACM0", sys.path()), std::nullopt);
  EXPECT_TRUE(serial_ports(sys.path() / "none").empty());
}

}  // namespace
}  // namespace absenc::os
