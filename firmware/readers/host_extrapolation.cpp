// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/extrapolation.hpp"

#include "firmware/readers/check.hpp"

namespace {
struct Part {
  void feed(const absenc::Reading& reading) {
    extrapolation.add(reading);
    instant = reading.received + std::chrono::microseconds(100);
  }
  [[nodiscard]] bool next(absenc::Time) {
    if (!extrapolation.valid()) return false;
    position = extrapolation.at(instant);
    return true;
  }
  absenc::host::Extrapolation extrapolation{};
  absenc::Time instant{};
  std::uint64_t position = 0;
};
}  // namespace

int main() { absenc::firmware::run<Part>(); }
