// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/first_reading.hpp"

#include "firmware/readers/check.hpp"

namespace {
struct Part {
  void feed(const absenc::Reading& reading) { agrees = first.confirms(reading); }
  [[nodiscard]] bool next(absenc::Time) const { return agrees; }
  absenc::host::FirstReading first{6000};
  bool agrees = false;
};
}  // namespace

int main() { absenc::firmware::run<Part>(); }
