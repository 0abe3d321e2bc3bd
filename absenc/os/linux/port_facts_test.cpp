// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/port_facts.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "absenc/os/linux/testing.hpp"

namespace absenc::os {

namespace fs = std::filesystem;

// A folder replaces /sys/class/tty, and a regular file replaces the port.
TEST(PortFacts, ReadsPropertiesFromSys) {
  const testing::TemporaryDirectory directory;
  const fs::path port = directory.path() / "ttyUSB7";
  std::ofstream{port};
  fs::create_directories(directory.path() / "drivers" / "ftdi_sio");
  const fs::path device = directory.path() / "sys" / "ttyUSB7" / "device";
  fs::create_directories(device);
  fs::create_directory_symlink(directory.path() / "drivers" / "ftdi_sio", device / "driver");
  std::ofstream(device / "latency_timer") << "16\n";
  const PortFacts facts = port_facts(port, directory.path() / "sys");
  EXPECT_EQ(facts.driver, "ftdi_sio");
  EXPECT_EQ(facts.latency_timer, 16u);
  EXPECT_FALSE(facts.counts);  // a regular file has no counts, because it is no terminal
  EXPECT_FALSE(facts.kernel_direction);

  const PortFacts unknown = port_facts(directory.path() / "ttyUSB8", directory.path() / "sys");
  EXPECT_EQ(unknown.driver, "");
  EXPECT_FALSE(unknown.latency_timer);
}

TEST(PortFacts, ClassifiesDrivers) {
  EXPECT_TRUE(is_modem_driver("option1"));
  EXPECT_FALSE(is_modem_driver("ftdi_sio"));
  EXPECT_TRUE(is_bare_uart("serial8250"));
  EXPECT_FALSE(is_bare_uart("ftdi_sio"));
  EXPECT_FALSE(is_bare_uart(""));
}

TEST(PortFacts, SubtractsCounts) {
  const LineCounts now{5, 7, 9, 11};
  const LineCounts gone = now.since({5, 6, 7, 8});
  EXPECT_EQ(gone.breaks, 0u);
  EXPECT_EQ(gone.framing, 1u);
  EXPECT_EQ(gone.parity, 2u);
  EXPECT_EQ(gone.overruns, 3u);
}

}  // namespace absenc::os
