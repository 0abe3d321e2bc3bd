// SPDX-License-Identifier: Apache-2.0
// Where a virtual encoder is played to a host that is judged.
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
  virtual HostTrial::Seen seen() = 0;
  virtual void set_fault(HostTrial::Fault fault) = 0;  // in place of the last one
  virtual void play(Time until) = 0;                   // throws os::Interrupted

 protected:
  ~HostStage() = default;
};

/// Throws UsageError where there is no host to judge.
void require_host(const Unit& unit, const Options& options);

/// Until it is over as `choices` say.
[[nodiscard]] Conformance judge_host(const Unit& unit, HostStage& stage, const ConformHostChoices& choices);

/// With what only an SPI controller sees.
[[nodiscard]] inline std::vector<RuleCount> with_mode(std::vector<RuleCount> counts, const os::SpiDevice& device) {
  counts.push_back({.rule = spi_mode_rule, .looked = device.messages(), .broken = device.wrong_modes()});
  return counts;
}

}  // namespace absenc::client
