// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/unwrap.hpp"

#include "firmware/readers/check.hpp"

namespace {
struct Part {
  void feed(const absenc::Reading& reading) {
    jumped = unwrapper.jumps(reading);
    joined = unwrapper.add(reading);
  }
  [[nodiscard]] bool next(absenc::Time) const {
    return !jumped && joined == absenc::host::Unwrapper::Joined::continued && unwrapper.position() != 0;
  }
  absenc::host::Unwrapper unwrapper{{.rpm = 6000}};
  absenc::host::Unwrapper::Joined joined{};
  bool jumped = false;
};
}  // namespace

int main() { absenc::firmware::run<Part>(); }
