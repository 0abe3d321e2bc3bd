// SPDX-License-Identifier: Apache-2.0
// Tests the clauses that change an encoder, and tries to restore the changed values.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/client/conform/evidence.hpp"
#include "absenc/client/row.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

/// Result of a command that the test ran on the encoder.
struct CommandResult {
  Error error = Error::none;
  std::string detail{};
  std::uint64_t requests = 0;  // number of requests that the command sent
  bool heard = false;          // whether anything but an echo was received after the last request of the command
  Answer answer{};
  // byte or word of the memory in the reply of the command; nothing: the reply has none
  std::optional<std::int64_t> value{};
  // several bytes of the memory in the reply of the command, low byte of a word first; empty: the reply has none
  std::vector<std::uint8_t> data{};
  std::optional<Reading> reading{};
};

/// A single request and its reply; each of them may be empty.
struct SingleExchange {
  capture::ObservedFrame request{};
  capture::ObservedFrame reply{};
};

/// The reply to an access to the memory, with the memory's busy bit.
struct BusyReply {
  bool busy = false;
  std::int64_t value = 0;
};

/// Number and times of the unsolicited frames that were received in a period.
struct UnsolicitedFrames {
  std::uint64_t frames = 0;
  Time first{};
  Time last{};

  /// Returns the rate in frames per second, rounded; for fewer than two frames their number.
  [[nodiscard]] std::int64_t per_second() const {
    if (frames < 2) return static_cast<std::int64_t>(frames);
    const std::int64_t between = (last - first).count();
    return (static_cast<std::int64_t>(frames - 1) * 1'000'000'000 + between / 2) / std::max<std::int64_t>(between, 1);
  }
};

/// Access to the line for a test that changes the encoder. If the test is interrupted, these functions throw
/// os::Interrupted only once, so that values can still be restored.
struct ChangesLine {
  std::function<CommandResult(const Command&, Arguments)> run;
  // sends a request in the form that Unit::encode gives, and returns the exchange
  std::function<SingleExchange(const std::vector<std::uint8_t>& request)> send;
  std::function<UnsolicitedFrames(Time)> count_unsolicited;
  std::function<void(Time)> wait_for;
  // adopts a new value of a setting, which may change how the encoder is reached
  std::function<void(const Command& setter, std::int64_t value)> note_setting;
  std::function<const Options&()> options;  // returns the options with which the encoder is reached now
};

/// Returns whether the reading's position is at most 1/512 turn away from the position `wanted`, which is in counts.
[[nodiscard]] bool is_near(const Reading& reading, std::uint64_t wanted);

class ChangeTester {
 public:
  /// Takes the encoder's name in commands for the user, its line, and whether values may be erased for good.
  ChangeTester(const Unit& unit, std::string_view name, ChangesLine line, bool resets)
      : unit_(unit), name_(name), line_(std::move(line)), resets_(resets) {}

  /// Tests one clause into `result`, and tries to restore changed values also after an exception.
  void test(const Clause& clause, ClauseResult& result);

  /// Returns the commands with which the user restores values that the test could not restore.
  [[nodiscard]] const std::vector<std::string>& left() const { return restore_commands_; }

 private:
  /// A value before the test changed it, and how to read, write and restore it.
  struct Saved {
    std::function<std::int64_t()> look{};
    std::function<void(std::int64_t)> write{};
    std::int64_t value = 0;
    std::string restore_command{};
  };

  void test_one(const Clause& clause, ClauseResult& result);
  void test_byte(const Clause& clause, ClauseResult& result);
  void test_bytes_beside(const Clause& clause, ClauseResult& result);
  void test_busy(const Clause& clause, ClauseResult& result);
  void test_closed(const Clause& clause, ClauseResult& result);
  void test_setting(const Clause& clause, ClauseResult& result);
  void test_offset(const Clause& clause, ClauseResult& result);
  void test_direction(const Clause& clause, ClauseResult& result);
  void test_pace(const Clause& clause, ClauseResult& result);
  void test_zero(ClauseResult& result);
  void test_reset(const Clause& clause, ClauseResult& result);
  void test_restart(const Clause& clause, ClauseResult& result);

  std::int64_t save(Saved one);
  std::int64_t save_byte(std::uint32_t page, std::uint32_t address);
  std::int64_t save_setting(const Clause& clause);
  void put_back();
  [[nodiscard]] bool put_back(const Saved& one);
  [[nodiscard]] bool may_erase(std::string_view what, ClauseResult& result) const;
  [[nodiscard]] CommandResult run(const Command& command, Arguments arguments) const;
  [[nodiscard]] SingleExchange send(const Command& command, Arguments arguments) const;
  [[nodiscard]] std::optional<BusyReply> busy_reply(const SingleExchange& sent) const;
  [[nodiscard]] Reading read() const;
  [[nodiscard]] std::int64_t read_byte(std::uint32_t page, std::uint32_t address) const;

  const Unit& unit_;
  std::string name_;
  ChangesLine line_;
  bool resets_;
  std::vector<Saved> saved_{};
  std::vector<std::string> restore_commands_{};
  bool interrupted_ = false;  // whether an interrupt came while values were being restored, and was delayed until then
};

}  // namespace absenc::client
