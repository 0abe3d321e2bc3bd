// SPDX-License-Identifier: Apache-2.0
// Test of a host: injects faults in phases and judges the host by each clause.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/conform.hpp"
#include "absenc/client/emulate.hpp"
#include "absenc/client/port/virtual_device.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

class HostTrial {
 public:
  enum class Fault : std::uint8_t { none, silence, damage, damaged_request };

  HostTrial(const Unit& unit, std::size_t answers) : unit_(unit), answers_(answers) {}

  /// Counts of requests, replies and checks of rules since the test began.
  struct TrialCounts {
    std::uint64_t answered = 0;  // requests that the encoder answered, including replies that a fault suppressed
    std::uint64_t missing = 0;   // replies that the fault `silence` suppressed
    std::uint64_t damaged = 0;   // replies that the fault `damage` changed
    RequestCounts requests{};
    std::vector<RuleCount> rules{};
  };
  /// Takes the latest counts and returns the fault that the encoder must inject from now on.
  Fault look(TrialCounts seen);
  [[nodiscard]] bool over() const { return phase_ == Phase::over; }

  /// Returns the verdict on each clause, from the latest counts.
  [[nodiscard]] Conformance judge() const;

 private:
  enum class Phase : std::uint8_t { good, silence, after_silence, damage, after_damage, refusal, last, over };
  // number of requests after a fault that suffice as proof that the host continues
  static constexpr std::uint64_t requests_to_continue = 3;

  [[nodiscard]] std::uint64_t counted() const;
  [[nodiscard]] std::uint64_t length() const;
  [[nodiscard]] bool is_calm() const;
  void judge_one(const HostClause& clause, ClauseResult& result) const;
  void judge_requests(ClauseResult& result) const;
  void judge_continuation(Phase phase, std::string_view what, std::uint64_t count, ClauseResult& result) const;
  void judge_rule(const HostClause& clause, ClauseResult& result) const;
  void conclude_if_all_are_requests(ClauseResult& result, bool kept, std::string evidence) const;

  const Unit& unit_;
  std::size_t answers_;
  Phase phase_ = Phase::good;
  // count of the events that decide how long a phase lasts, at the beginning of the present phase
  std::uint64_t phase_begin_ = 0;
  // number of requests that arrived while the fault `damaged_request` damaged every request
  std::uint64_t refused_ = 0;
  TrialCounts seen_{};
  // counts of rule checks; checks during a fault that affects the host are not counted
  std::vector<RuleCount> calm_{};
};

/// Returns how often the virtual encoder injected `fault`, which is `silence` or `damage`.
[[nodiscard]] inline std::uint64_t count_of(const VirtualDevice& encoder, HostTrial::Fault fault) {
  const sim::FaultKind kind = fault == HostTrial::Fault::silence ? sim::FaultKind::silence : sim::FaultKind::corrupt;
  return encoder.faults() != nullptr ? (*encoder.faults())[static_cast<std::size_t>(kind)] : 0;
}

/// Returns the name that the virtual encoder uses for this fault; "" if there is no fault.
[[nodiscard]] constexpr std::string_view name_of(HostTrial::Fault fault) {
  switch (fault) {
    case HostTrial::Fault::silence:
      return "silence";
    case HostTrial::Fault::damage:
      return "corrupt";
    case HostTrial::Fault::damaged_request:
      return "request_corrupt";
    case HostTrial::Fault::none:
      break;
  }
  return "";
}

}  // namespace absenc::client
