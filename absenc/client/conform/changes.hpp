// SPDX-License-Identifier: Apache-2.0
// Tests the clauses that change an encoder, and puts back what they changed, however they end.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/client/conform.hpp"
#include "absenc/client/row.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

inline void conclude(ClauseResult& result, bool kept, std::string evidence) {
  result.verdict = kept ? Verdict::kept : Verdict::broken;
  result.evidence = std::move(evidence);
}

/// How a command ended, and what it told.
struct Ran {
  Error error = Error::none;
  std::string detail{};
  Answer answer{};
  std::vector<std::uint8_t> data{};  // of a memory
  std::optional<Reading> reading{};
};

/// What it needs of the line, whatever that carries. Both throw what the port throws; os::Interrupted once for each
/// time that somebody asks to end.
struct ChangesLine {
  std::function<Ran(const Command&, Arguments)> run;
  std::function<void(Time)> rest;
  std::function<void(const Command& setter, std::int64_t value)> follow;  // it is set so now, and reached so
};

/// Within what a shaft at rest may tremble.
[[nodiscard]] bool is_near(const Reading& reading, std::uint64_t wanted);

class Changes {
 public:
  /// `name` is how the user calls the encoder.
  Changes(const Unit& unit, std::string_view name, ChangesLine line)
      : unit_(unit), name_(name), line_(std::move(line)) {}

  /// Throws what ended it before its end; then, too, all is put back that could be.
  void test(const Clause& clause, ClauseResult& result);

  /// The commands that put back by hand what could not be.
  [[nodiscard]] const std::vector<std::string>& left() const { return left_; }

 private:
  /// A byte, or a setting, as it was.
  struct Saved {
    const Command* getter = nullptr;
    std::vector<std::int64_t> where{};  // the getter's arguments
    std::string_view field{};           // of the getter's answer; "": its byte
    const Command* setter = nullptr;
    std::vector<std::int64_t> arguments{};  // the setter's
    std::int64_t value = 0;
    std::string by_hand{};
  };

  void test_one(const Clause& clause, ClauseResult& result);
  void test_byte(const Clause& clause, ClauseResult& result);
  void test_setting(const Clause& clause, ClauseResult& result);
  void test_zero(const Clause& clause, ClauseResult& result);
  void test_reset(const Clause& clause, ClauseResult& result);

  std::int64_t save_byte(const Clause& clause, std::uint32_t address);
  std::int64_t save_setting(const Clause& clause);
  void put_back();
  [[nodiscard]] bool put_back(const Saved& one);
  [[nodiscard]] std::int64_t value_of(const Saved& one) const;
  void write(const Saved& one, std::int64_t value) const;
  [[nodiscard]] Ran run(const Command& command, Arguments arguments) const;
  [[nodiscard]] Reading read() const;

  const Unit& unit_;
  std::string name_;
  ChangesLine line_;
  std::vector<Saved> saved_{};
  std::vector<std::string> left_{};
  bool interrupted_ = false;  // while something was put back
};

}  // namespace absenc::client
