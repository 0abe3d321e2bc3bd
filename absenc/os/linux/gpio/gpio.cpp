// SPDX-License-Identifier: Apache-2.0
// Adds GPIO lines to the wires for pulses. No other file includes libgpiod.
#include "absenc/os/gpio.hpp"

#include <gpiod.h>

#include <string>

#include "absenc/os/pulse_wire.hpp"

namespace absenc::os {

namespace {

struct GpioKernel final : WireKernel {
  gpiod_line* find_gpio(const std::string& name) override { return ::gpiod_line_find(name.c_str()); }
  int request_gpio(gpiod_line* line, bool active_low) override {
    return ::gpiod_line_request_output_flags(line, "absenc", active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0, 0);
  }
  int set_gpio(gpiod_line* line, int value) override { return ::gpiod_line_set_value(line, value); }
  void release_gpio(gpiod_line* line) override { ::gpiod_line_close_chip(line); }
};

}  // namespace

bool use_gpio() {
  static GpioKernel kernel;
  set_system_wires(kernel);
  return true;
}

}  // namespace absenc::os
