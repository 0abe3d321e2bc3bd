// SPDX-License-Identifier: Apache-2.0
// What a host is put to, and what it is judged by, whoever plays the encoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/conform.hpp"
#include "absenc/client/emulate.hpp"
#include "absenc/client/emulation/virtual_device.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

class HostTrial {
 public:
  enum class Fault : std::uint8_t { none, silence, damage };

  explicit HostTrial(std::size_t answers) : answers_(answers) {}

  /// What was counted up to now.
  struct Seen {
    std::uint64_t answered = 0;  // requests that the encoder answered, also where a fault kept the reply from the host
    std::uint64_t missing = 0;   // of these replies, by the fault `silence`
    std::uint64_t damaged = 0;   // by the fault `damage`
    RequestCounts requests{};
    std::vector<RuleCount> rules{};
  };
  /// The fault that replies are to have from now on.
  Fault look(Seen seen);
  [[nodiscard]] bool over() const { return phase_ == Phase::over; }

  /// By what the last look saw.
  [[nodiscard]] Conformance judge(const Unit& unit) const;

 private:
  enum class Phase : std::uint8_t { good, silence, between, damage, last, over };
  static constexpr std::uint64_t asked_again = 3;  // requests that show that it goes on

  [[nodiscard]] std::uint64_t counted() const;
  [[nodiscard]] std::uint64_t length() const;
  [[nodiscard]] bool is_calm() const;
  void judge_one(const HostClause& clause, ClauseResult& result) const;
  void judge_requests(ClauseResult& result) const;
  void judge_going_on(Phase phase, ClauseResult& result) const;
  void judge_rule(const HostClause& clause, ClauseResult& result) const;
  void conclude_if_all_are_requests(ClauseResult& result, bool kept, std::string evidence) const;

  std::size_t answers_;
  Phase phase_ = Phase::good;
  std::uint64_t begun_at_ = 0;  // of `counted`
  Seen seen_{};
  std::vector<RuleCount> calm_{};  // of them those while replies were good, and no host had to give anything up
};

/// How often the virtual encoder did so.
[[nodiscard]] inline std::uint64_t count_of(const VirtualDevice& encoder, HostTrial::Fault fault) {
  const sim::FaultKind kind = fault == HostTrial::Fault::silence ? sim::FaultKind::silence : sim::FaultKind::corrupt;
  return encoder.faults() != nullptr ? (*encoder.faults())[static_cast<std::size_t>(kind)] : 0;
}

/// The virtual encoder's fault that makes replies so: "" for none.
[[nodiscard]] constexpr std::string_view name_of(HostTrial::Fault fault) {
  if (fault == HostTrial::Fault::none) return "";
  return fault == HostTrial::Fault::silence ? "silence" : "corrupt";
}

}  // namespace absenc::client
