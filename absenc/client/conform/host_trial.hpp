// SPDX-License-Identifier: Apache-2.0
// What a host is put to, and what it is judged by, whoever plays the encoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "absenc/client/conform.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

class HostTrial {
 public:
  enum class Fault : std::uint8_t { none, silence, damage };

  explicit HostTrial(std::size_t answers) : answers_(answers) {}

  /// The fault that replies are to have from now on, when so many requests were answered, well or not.
  Fault look(std::uint64_t answered);
  [[nodiscard]] bool over() const { return phase_ == Phase::over; }

  [[nodiscard]] Conformance judge(const Unit& unit, std::span<const std::string> broken_rules) const;

 private:
  enum class Phase : std::uint8_t { good, silence, between, damage, last, over };
  static constexpr std::uint64_t asked_again = 3;  // requests that show that it goes on

  [[nodiscard]] std::uint64_t length() const;
  void judge_one(const HostClause& clause, std::span<const std::string> broken_rules, ClauseResult& result) const;

  std::size_t answers_;
  Phase phase_ = Phase::good;
  std::uint64_t begun_at_ = 0;
  std::uint64_t answered_ = 0;
};

}  // namespace absenc::client
