// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/short_names.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

namespace absenc::tool {
namespace {

using testing::ElementsAre;
using Names = std::vector<std::string>;

TEST(ShortNames, StayAsTheyAreWhereThereIsRoom) {
  EXPECT_THAT(short_names(Names{"elbow", "wrist"}, 8), ElementsAre("elbow", "wrist"));
  EXPECT_THAT(short_names(Names{}, 8), ElementsAre());
}

TEST(ShortNames, AreCutInTheMiddle) {
  EXPECT_THAT(short_names(Names{"esl:/dev/ttyUSB0?address=3"}, 12), ElementsAre("esl:/..ess=3"));
  EXPECT_THAT(short_names(Names{"esl:/dev/ttyUSB0?address=0", "esl:/dev/ttyUSB0?address=3", "elbow"}, 12),
              ElementsAre("esl:/..ess=0", "esl:/..ess=3", "elbow"));
}

TEST(ShortNames, KeepWhatDiffers) {
  EXPECT_THAT(short_names(Names{"esl:/dev/ttyUSB0?latency=300", "esl:/dev/ttyUSB1?latency=300"}, 20),
              ElementsAre("esl:/..0?latency=300", "esl:/..1?latency=300"));
  const std::string port = "tformat:/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_";
  const Names ports{port + "A9M9DV3R-if00-port0?latency=5", port + "A50285BI-if00-port0?latency=5"};
  EXPECT_THAT(short_names(ports, 20), ElementsAre("..9M9DV3R..", "..50285BI.."));
}

TEST(ShortNames, DifferWhateverTheyAre) {
  std::mt19937 random(1);
  for (int run = 0; run < 2000; ++run) {
    Names names(1 + random() % 30);
    for (std::string& name : names) {
      name.resize(1 + random() % 60, 'a');
      for (unsigned i = random() % 4; i > 0; --i) name[random() % name.size()] = static_cast<char>('a' + random() % 3);
    }
    const std::size_t width = 8 + random() % 20;
    const Names cuts = short_names(names, width);
    ASSERT_EQ(cuts.size(), names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      EXPECT_LE(cuts[i].size(), width);
      for (std::size_t other = 0; other < i; ++other) EXPECT_EQ(cuts[i] == cuts[other], names[i] == names[other]);
    }
  }
}

}  // namespace
}  // namespace absenc::tool
