// SPDX-License-Identifier: Apache-2.0
// Runs the virtual encoder that serves a host during a conformance test of the host.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/client/conform/host_trial.hpp"
#include "absenc/client/conform_host.hpp"
#include "absenc/client/emulation/rule_counter.hpp"
#include "absenc/os/spi_device.hpp"

namespace absenc::client {

class HostStage {
 public:
  virtual HostTrial::TrialCounts seen() = 0;
  virtual void set_fault(HostTrial::Fault fault) = 0;  // injects `fault` in place of the previous fault
  // serves the host until the time `until`; throws exceptions of the port
  virtual void play(Time until) = 0;

 protected:
  ~HostStage() = default;
};

/// Checks that a host of the unit can be judged. Throws UsageError.
void require_host(const Unit& unit, const Options& options);

/// Serves the host until `choices` end the test, and returns the verdicts on the host.
[[nodiscard]] Conformance judge_host(const Unit& unit, HostStage& stage, const ConformHostChoices& choices);

/// Returns `counts` together with the count of the rule about the SPI mode, which only the SPI device can check.
[[nodiscard]] inline std::vector<RuleCount> with_mode(std::vector<RuleCount> counts, const os::SpiDevice& device) {
  counts.push_back({.rule = spi_mode_rule, .looked = device.messages(), .broken = device.wrong_modes()});
  return counts;
}

}  // namespace absenc::client
