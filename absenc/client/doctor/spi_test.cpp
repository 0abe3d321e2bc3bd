// SPDX-License-Identifier: Apache-2.0
// Checks that doctor finds the mode of an SPI controller, with the settings of the kernel's driver.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/doctor/observed_test.hpp"
#include "absenc/os/linux/fake_spi_test.hpp"

namespace absenc::client {

using testing::Contains;

TEST(Doctor, TheModeOfAnSpiControllerIsFoundOnItsWires) {
  os::testing::FakeSpi kernel;
  EncoderAddress address = parse_address("encolink-spi:spi:/dev/spidev0.0?spi_mode=0");
  VirtualDevice device(*address.unit, address.options, {});
  device.power_on(os::now());
  LineSettings right = address.line;
  kernel.connect(address.unit->link, right, *device.bytes());
  const Surroundings surroundings{[&](const EncoderAddress& to) {
    const auto port = std::make_shared<os::SpiPort>(to.path, to.unit->link, to.line, to.spi, kernel);
    Link link;
    link.bytes = port.get();
    link.owner = port;
    return link;
  }};
  const Examination wrong = examine(address, {.readings = 20}, surroundings);
  ASSERT_THAT(ids(wrong), Contains("wrong_spi_mode"));
  EXPECT_EQ(wrong.findings.at(0).action, "set spi_mode=" + std::to_string(right.spi_mode));
}

}  // namespace absenc::client
