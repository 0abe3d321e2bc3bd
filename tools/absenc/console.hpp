// SPDX-License-Identifier: Apache-2.0
// What is written on standard input while virtual encoders run: their conditions, power, alarms and faults.
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
  /// All must outlive it. The encoders are of one unit, and are told apart by their number, from 1 on.
  Console(const Unit& unit, std::vector<VirtualDevice*> devices) : unit_(unit), devices_(std::move(devices)) {}

  /// Carries out the lines that are there, and answers each by one line on standard output.
  void look(Time now);
  /// Nothing comes any more.
  [[nodiscard]] bool ended() const { return lines_.ended() || unheard_; }

  /// What is so afterwards. Throws UsageError, which says what is possible.
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
  bool unheard_ = false;  // nobody reads the answers
};

}  // namespace absenc::tool
