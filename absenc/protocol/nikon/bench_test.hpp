// SPDX-License-Identifier: Apache-2.0
// For the tests of Nikon's A-format: a virtual encoder and a host on one line in virtual time.
#pragma once

#include <gtest/gtest.h>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/nikon/device.hpp"
#include "absenc/protocol/nikon/unit.hpp"

namespace absenc::nikon::testing {

using author::testing::Numbers;
using author::testing::Tamper;
using author::testing::wire;
using author::testing::Wire;

/// A virtual encoder and a host on one line, with a shaft of 20 bits. `tamper` changes the replies of the encoder.
struct Bench : author::testing::UnitBench<20> {
  explicit Bench(std::string_view settings = "") : UnitBench(nikon::unit, settings) {}
  explicit Bench(Tamper tamper) : Bench() { tampered.replies(std::move(tamper)); }
};

}  // namespace absenc::nikon::testing
