// SPDX-License-Identifier: Apache-2.0
// Executes commands from standard input while virtual encoders run.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/port/virtual_device.hpp"
#include "absenc/link/step.hpp"
#include "absenc/os/input_lines.hpp"

namespace absenc::tool {

using namespace client;

class Console {
 public:
  /// Makes a console for virtual encoders of the protocol `unit`. The unit and the encoders must outlive it.
  Console(const Unit& unit, std::vector<VirtualDevice*> devices) : unit_(unit), devices_(std::move(devices)) {}

  /// Executes the lines that wait on standard input, and prints the answers.
  void look(Time now);
  /// Returns whether standard input has ended or standard output was closed.
  [[nodiscard]] bool ended() const { return lines_.ended() || unheard_; }

  /// Executes `line` for all encoders, or for one encoder if the line begins with its number, as in "2:". Returns the
  /// answer. Throws UsageError.
  [[nodiscard]] std::string carry_out(std::string_view line, Time now);

 private:
  [[nodiscard]] std::string carry_out_one(VirtualDevice& device, std::string_view line, Time now) const;
  [[nodiscard]] std::string condition(VirtualDevice& device, std::string_view line, Time now) const;
  [[nodiscard]] std::string alarms(VirtualDevice& device, std::string_view names, bool raise) const;
  [[nodiscard]] static std::string faults(VirtualDevice& device, std::string_view wanted);
  [[nodiscard]] std::string help() const;

  const Unit& unit_;
  std::vector<VirtualDevice*> devices_;
  os::InputLines lines_;
  bool unheard_ = false;  // whether standard output was found closed, so that nobody reads the answers
};

}  // namespace absenc::tool
