// SPDX-License-Identifier: Apache-2.0
// What a host is put to, and what it is judged by, whoever plays the encoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "absenc/client/conform.hpp"
#include "absenc/client/emulate.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

class HostTrial {
 public:
  enum class Fault : std::uint8_t { none, silence, damage };

  explicit HostTrial(std::size_t answers) : answers_(answers) {}

  /// The fault that replies are to have from now on, when so many requests were answered, well or not, and each rule
  /// was looked at so often.
  Fault look(std::uint64_t answered, std::span<const RuleCount> rules);
  [[nodiscard]] bool over() const { return phase_ == Phase::over; }

  /// By what the last look saw.
  [[nodiscard]] Conformance judge(const Unit& unit) const;

 private:
  enum class Phase : std::uint8_t { good, silence, between, damage, last, over };
  static constexpr std::uint64_t asked_again = 3;  // requests that show that it goes on

  [[nodiscard]] std::uint64_t length() const;
  [[nodiscard]] bool is_calm() const;
  void judge_one(const HostClause& clause, ClauseResult& result) const;

  std::size_t answers_;
  Phase phase_ = Phase::good;
  std::uint64_t begun_at_ = 0;
  std::uint64_t answered_ = 0;
  std::vector<RuleCount> rules_{};
  std::vector<RuleCount> calm_{};  // of them those while replies were good, and no host had to give anything up
};

/// The virtual encoder's fault that makes replies so: "" for none.
[[nodiscard]] constexpr std::string_view name_of(HostTrial::Fault fault) {
  if (fault == HostTrial::Fault::none) return "";
  return fault == HostTrial::Fault::silence ? "silence" : "corrupt";
}

}  // namespace absenc::client
