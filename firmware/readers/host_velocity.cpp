// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/velocity.hpp"

#include "firmware/readers/check.hpp"

namespace {
struct Part {
  void feed(const absenc::Reading& reading) {
    velocity.add(static_cast<std::int64_t>(reading.singleturn), absenc::host::latch_time(reading));
  }
  [[nodiscard]] bool next(absenc::Time) {
    speed = velocity.speed();
    return velocity.valid();
  }
  absenc::host::Velocity velocity{std::chrono::milliseconds(1)};
  absenc::host::MilliSpeed speed;
};
}  // namespace

int main() { absenc::firmware::run<Part>(); }
