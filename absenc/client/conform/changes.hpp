// SPDX-License-Identifier: Apache-2.0
// Tests the clauses that change an encoder, and puts back what they changed, however they end.
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

/// How a command ended, and what it told.
struct Ran {
  Error error = Error::none;
  std::string detail{};
  std::uint64_t requests = 0;  // that it sent
  bool heard = false;          // something came behind the last of them
  Answer answer{};
  std::vector<std::uint8_t> data{};  // of a memory
  std::optional<Reading> reading{};
};

/// A request that was sent by itself, and what came; both empty: nothing is asked with these options.
struct Sent {
  capture::ObservedFrame request{};
  capture::ObservedFrame reply{};
};

/// A reply of the memory, with its busy bit.
struct BusyReply {
  bool busy = false;
  std::int64_t value = 0;
};

/// Frames that came by themselves.
struct Heard {
  std::uint64_t frames = 0;
  Time first{};
  Time last{};

  /// To the nearest, by the time between the first and the last.
  [[nodiscard]] std::int64_t per_second() const {
    if (frames < 2) return static_cast<std::int64_t>(frames);
    const std::int64_t between = (last - first).count();
    return (static_cast<std::int64_t>(frames - 1) * 1'000'000'000 + between / 2) / std::max<std::int64_t>(between, 1);
  }
};

/// The line as Changes needs it, whatever that carries. All throw what the port throws; os::Interrupted once for each
/// time that somebody asks to end.
struct ChangesLine {
  std::function<Ran(const Command&, Arguments)> run;
  std::function<Sent(const std::vector<std::uint8_t>& request)> send;  // as Unit::encode makes it
  std::function<Heard(Time)> hear;
  std::function<void(Time)> rest;
  std::function<void(const Command& setter, std::int64_t value)> follow;  // it is set so now, and reached so
  std::function<const Options&()> options;                                // as they are now
};

/// Within what a shaft at rest may tremble.
[[nodiscard]] bool is_near(const Reading& reading, std::uint64_t wanted);

class Changes {
 public:
  /// `name` is how the user calls the encoder. `resets`: what nothing could bring back may be lost.
  Changes(const Unit& unit, std::string_view name, ChangesLine line, bool resets)
      : unit_(unit), name_(name), line_(std::move(line)), resets_(resets) {}

  /// Throws what ended it before its end; then, too, all is put back that could be.
  void test(const Clause& clause, ClauseResult& result);

  /// The commands that put back by hand what could not be.
  [[nodiscard]] const std::vector<std::string>& left() const { return left_; }

 private:
  /// A value that was found, how to look at it, and how to write it.
  struct Saved {
    std::function<std::int64_t()> look{};
    std::function<void(std::int64_t)> write{};
    std::int64_t value = 0;
    std::string by_hand{};
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
  [[nodiscard]] bool may_lose(std::string_view what, ClauseResult& result) const;
  [[nodiscard]] Ran run(const Command& command, Arguments arguments) const;
  [[nodiscard]] Sent send(const Command& command, Arguments arguments) const;
  [[nodiscard]] std::optional<BusyReply> busy_reply(const Sent& sent) const;
  [[nodiscard]] Reading read() const;
  [[nodiscard]] std::uint8_t read_byte(std::uint32_t page, std::uint32_t address) const;

  const Unit& unit_;
  std::string name_;
  ChangesLine line_;
  bool resets_;
  std::vector<Saved> saved_{};
  std::vector<std::string> left_{};
  bool interrupted_ = false;  // while something was put back
};

}  // namespace absenc::client
