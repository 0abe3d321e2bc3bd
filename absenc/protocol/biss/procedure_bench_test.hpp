// SPDX-License-Identifier: Apache-2.0
// A host that runs one procedure after the other against one encoder, in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <initializer_list>
#include <vector>

#include "absenc/protocol/biss/commands.hpp"
#include "absenc/protocol/biss/device.hpp"
#include "absenc/sim/line.hpp"
#include "absenc/sim/motion.hpp"

namespace absenc::biss::testing {

inline constexpr Format bits_24{.word = "position:24 error:1! warning:1!"_word};

template <auto procedure, auto... bound>
struct ProcedureRun final : author::Run<Protocol, ControlResults, procedure, bound...> {
  using author::Run<Protocol, ControlResults, procedure, bound...>::Run;
  void report(FieldSink&) const override {}
};

struct ProcedureBench {
  explicit ProcedureBench(const Format& of = bits_24) : format(of), encoder(of, motion) {
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line.attach(sim::NodeRole::device, encoder);
  }
  template <auto procedure, auto... bound>
  ControlResults ask(std::initializer_list<std::int64_t> arguments = {}, Error expected = Error::none) {
    std::vector<std::byte> storage(4096);
    ProcedureRun<procedure, bound...> asking(format, {arguments.begin(), arguments.size()}, storage);
    if (node == none) {
      node = line.attach(sim::NodeRole::host, asking);
    } else {
      line.replace(node, asking);
    }
    EXPECT_TRUE(line.run(node, line.now() + 10s));
    EXPECT_EQ(asking.error(), expected) << asking.detail();
    return asking.found();
  }

  static constexpr std::size_t none = ~std::size_t{0};
  Format format;
  sim::Motion motion = sim::Motion::constant_speed(0, 600);
  VirtualEncoder encoder;
  sim::Line<std::uint8_t> line{LinkKind::clocked, line_settings};
  std::size_t node = none;
};

}  // namespace absenc::biss::testing
