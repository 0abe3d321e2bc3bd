// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/serial_ports.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "absenc/os/linux/testing.hpp"

namespace absenc::os {

namespace fs = std::filesystem;

namespace {

/// Test folders with the layout of /sys: only the USB device has identification numbers.
class ListedPorts : public ::testing::Test {
 protected:
  void write(const fs::path& file, std::string_view text) const {
    fs::create_directories((root() / file).parent_path());
    std::ofstream(root() / file) << text << '\n';
  }

  void plug_in(std::string_view vendor, std::string_view product, std::string_view release) const {
    const fs::path device = "devices/usb1/1-2";
    write(device / "idVendor", vendor);
    write(device / "idProduct", product);
    write(device / "bcdDevice", release);
    write(device / "manufacturer", "FTDI");
    write(device / "product", "FT232R USB UART");
    write(device / "serial", "A50285BI");
    write(device / "1-2:1.0/ttyUSB0/latency_timer", "16");
    fs::create_directories(root() / "drivers/ftdi_sio");
    fs::create_directory_symlink(root() / "drivers/ftdi_sio", root() / device / "1-2:1.0/ttyUSB0/driver");
    fs::create_directories(sys() / "ttyUSB0");
    fs::create_directory_symlink(root() / device / "1-2:1.0/ttyUSB0", sys() / "ttyUSB0" / "device");
    write("dev/ttyUSB0", "");
  }

  [[nodiscard]] fs::path root() const { return directory_.path(); }
  [[nodiscard]] fs::path sys() const { return root() / "class"; }
  [[nodiscard]] ListedPort look() const { return inspect_port(root() / "dev/ttyUSB0", sys(), root() / "by-id"); }

 private:
  testing::TemporaryDirectory directory_;
};

TEST_F(ListedPorts, ReadsIdentityOfAdapter) {
  plug_in("0403", "6001", "0600");
  fs::create_directories(root() / "by-id");
  fs::create_symlink(root() / "dev/ttyUSB0", root() / "by-id/usb-FTDI_A50285BI");
  const ListedPort port = look();
  ASSERT_TRUE(port.usb);
  EXPECT_EQ(port.usb->maker, "FTDI");
  EXPECT_EQ(port.usb->name, "FT232R USB UART");
  EXPECT_EQ(port.usb->serial_number, "A50285BI");
  EXPECT_EQ(port.driver, "ftdi_sio");
  EXPECT_EQ(port.latency_timer, 16u);
  EXPECT_EQ(port.highest_rate, 3'000'000u);
  EXPECT_EQ(port.lasting_path, root() / "by-id/usb-FTDI_A50285BI");
  EXPECT_EQ(port.refusal, "");
  EXPECT_EQ(port.holder, "");
}

TEST_F(ListedPorts, UnknownChipHasNoRate) {
  plug_in("0403", "6010", "0700");
  EXPECT_EQ(look().highest_rate, 12'000'000u);  // the release number bcdDevice identifies the chip
  write("devices/usb1/1-2/bcdDevice", "9999");
  EXPECT_FALSE(look().highest_rate);
  write("devices/usb1/1-2/idVendor", "10c4");
  // CP2102 and CP2102N, which is three times as fast, have the same product number ea60.
  write("devices/usb1/1-2/idProduct", "ea60");
  EXPECT_FALSE(look().highest_rate);
  EXPECT_EQ(look().lasting_path, "");
}

TEST_F(ListedPorts, AUartHasTheRateOfItsClock) {
  write("class/ttyS0/uartclk", "1843200");
  write("dev/ttyS0", "");
  const ListedPort port = inspect_port(root() / "dev/ttyS0", sys(), root() / "by-id");
  EXPECT_FALSE(port.usb);
  EXPECT_EQ(port.highest_rate, 115'200u);
}

TEST_F(ListedPorts, FindsUartDriverBehindKernelDevices) {
  for (const auto& [device, driver] :
       {std::pair{"uart", "serial8250"}, {"uart/uart:0", "ctrl"}, {"uart/uart:0/uart:0.0", "port"}}) {
    fs::create_directories(root() / "drivers" / driver);
    fs::create_directories(root() / device);
    fs::create_directory_symlink(root() / "drivers" / driver, root() / device / "driver");
  }
  fs::create_directories(sys() / "ttyS0");
  fs::create_directory_symlink(root() / "uart/uart:0/uart:0.0", sys() / "ttyS0" / "device");
  EXPECT_EQ(driver_of("ttyS0", sys()), "serial8250");
  EXPECT_EQ(driver_of("ttyS1", sys()), "");
}

TEST_F(ListedPorts, NamesProgramThatHasPortOpen) {
  plug_in("0403", "6001", "0600");
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const pid_t holder = ::fork();
  ASSERT_GE(holder, 0);
  if (holder == 0) {
    const bool open = ::open((root() / "dev/ttyUSB0").c_str(), O_RDONLY) >= 0;
    if (open && ::write(ready[1], "x", 1) == 1) ::pause();
    ::_exit(1);
  }
  char byte = 0;
  ::close(ready[1]);
  EXPECT_EQ(::read(ready[0], &byte, 1), 1);
  ::close(ready[0]);
  EXPECT_NE(look().holder.find("(process " + std::to_string(holder) + ")"), std::string::npos) << look().holder;
  ::kill(holder, SIGKILL);
  ::waitpid(holder, nullptr, 0);
  EXPECT_EQ(look().holder, "");
}

TEST_F(ListedPorts, PortInUseNamesItsHolder) {
  plug_in("0403", "6001", "0600");
  const std::string path = root() / "dev/ttyUSB0";
  const int port = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(::flock(port, LOCK_EX | LOCK_NB), 0);
  std::array<char, 16> name{};
  ::prctl(PR_GET_NAME, name.data());
  using Holder = Failure::Holder;
  const auto found = [&](const char* program) {
    ::prctl(PR_SET_NAME, program);
    const Failure failure = open_failure(path, EWOULDBLOCK);
    EXPECT_EQ(failure.kind(), Failure::Kind::in_use);
    EXPECT_NE(std::string_view(failure.what()).find(program), std::string_view::npos) << failure.what();
    return failure.holder();
  };
  EXPECT_EQ(found("ModemManager"), Holder::modem_manager);
  EXPECT_EQ(found("minicom"), Holder::program);
  EXPECT_EQ(found("absenc"), Holder::absenc);
  ::prctl(PR_SET_NAME, name.data());
  ::close(port);
}

TEST_F(ListedPorts, UnopenablePortStatesReason) {
  plug_in("0403", "6001", "0600");
  fs::remove(root() / "dev/ttyUSB0");
  EXPECT_NE(look().refusal.find("there is no port"), std::string::npos);
}

}  // namespace

}  // namespace absenc::os
