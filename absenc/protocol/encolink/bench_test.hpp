// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual AksIM-2 and a host on one line in virtual time.
#pragma once

#include <gtest/gtest.h>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/encolink/device.hpp"
#include "absenc/protocol/encolink/unit.hpp"

namespace absenc::encolink::testing {

using author::testing::RunResult;
using RawBytes = std::vector<std::uint8_t>;

inline constexpr std::string_view single = "resolution=20 multiturn_bits=0";
inline constexpr std::string_view multi = "resolution=20 multiturn_bits=16";
inline constexpr Format single_format{.resolution = 20, .multiturn_bits = 0};
inline constexpr Format multi_format{.resolution = 20, .multiturn_bits = 16};

struct Bench : author::testing::UnitBench<20> {
  explicit Bench(std::string_view settings = multi, Interface interface = Interface::uart)
      : UnitBench(interface == Interface::spi ? spi_unit : encolink::unit, settings) {
    shaft.put(7, 0x12345);
  }
  /// Sends the requests one after the other, each padded with zeros to at least `size` bytes; returns the replies.
  std::vector<RawBytes> ask(std::vector<RawBytes> requests, std::size_t size = 0) {
    std::vector<RawBytes> replies;
    for (RawBytes& request : requests) {
      if (request.size() < size) request.resize(size);
      replies.push_back(raw(request, 300us, 15us).reply);
    }
    return replies;
  }
  VirtualEncoder& encoder = static_cast<VirtualEncoder&>(device);
};

/// Base class of tests that run on both UART and SPI.
class OnBothInterfaces : public ::testing::TestWithParam<Interface> {
 protected:
  const Interface interface = GetParam();
};

inline bool says(const std::string& text, std::string_view words) { return text.find(words) != std::string::npos; }

}  // namespace absenc::encolink::testing
