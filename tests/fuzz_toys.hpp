// SPDX-License-Identifier: Apache-2.0
// Helpers that fuzz targets share.
#pragma once

#include <cstdlib>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/field.hpp"

namespace absenc::fuzz {

inline void require(bool condition) {
  if (!condition) std::abort();
}

struct Still final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return {}; }
};

struct Counting final : FieldSink {
  void put(const FieldValue&) override { ++count; }
  unsigned count = 0;
};

}  // namespace absenc::fuzz
