// SPDX-License-Identifier: Apache-2.0
// One encoder read again and again by a thread of its own; others look at what is known of it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absenc/client/encoder.hpp"
#include "absenc/client/encoder/connection.hpp"

namespace absenc::tool {

using namespace client;

/// What is known of an encoder at a moment.
struct Snapshot {
  enum class State : std::uint8_t {
    opening,  // its port was not there yet
    live,     // the reading is new
    silent,   // none has come for a while
    failing,  // the last attempt failed
    lost,     // the port has gone away
    paused,   // it is not being read
    ended,    // it cannot be read at all: `message` says why
  };

  State state = State::opening;
  Time age{};  // of the reading, or of what is known instead
  bool has_reading = false;
  Sample last{};          // the last reading, if there was one; only to be shown as the present one while `live`
  std::string message{};  // failing, lost, opening, ended: why
  std::string notice{};   // how the last command ended, and whether it still runs
  host::Counters counters{};
  std::uint64_t readings = 0;
  std::uint64_t losses = 0;
  std::uint64_t restarts = 0;  // of the position, as Encoder::restarts
  double rate = 0;             // readings a second
  Time median{};               // of the latencies
  Time percentile_99{};
  Time longest{};
  std::vector<std::string> trace{};    // only with details; the newest last
  std::vector<BadExchangeText> bad{};  // only with details; the newest first
  std::vector<std::string> fields{};   // only with details: "name value", of the last reply what the reading lacks
};

[[nodiscard]] std::string_view name_of(Snapshot::State state);

/// Ports block, which keeps them simple, and 64 threads cost less processor time a reading than one
/// (docs/benchmarks.md). What is known is handed out as a copy, so that the screen never waits for a line.
class Watch {
 public:
  /// `name` as the user wrote it. The first reading comes `offset` after the start.
  Watch(std::string name, const EncoderAddress& uri, double rate, Time offset);
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Ends the thread, within the time that one reading may take; the destructor does it too.
  void stop();

  [[nodiscard]] Snapshot snapshot(bool details) const;
  void pause(bool paused);
  /// Runs a command without arguments between two readings; the notice tells how it ended.
  void run(const Command& command);
  /// Shows the text in place of how the last command ended.
  void notify(std::string text);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const EncoderAddress& uri() const { return uri_; }
  [[nodiscard]] Time start() const { return start_; }

 private:
  void work(const std::stop_token& stop);
  void publish(const Encoder& live, const Sample& sample);
  void trace(const Encoder& live, const Sample& sample);
  void add_line(Time at, const std::string& text);
  void run_command(Encoder& live, const Command& command);
  [[nodiscard]] static std::string result_of(Encoder& live, const Command& command);
  void end(const std::string& why);

  std::string name_;
  EncoderAddress uri_;
  double rate_;
  Time offset_;
  Time start_;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  Snapshot known_;
  Time known_at_{};  // of the last reading, or of the last change of state
  std::deque<std::string> lines_;
  bool paused_ = false;
  std::optional<Command> command_;

  // Of the thread alone.
  Time next_summary_{};
  Time next_line_{};
  std::uint32_t alarms_ = 0;
  std::uint32_t alarms_reported_ = 0;
  bool restarted_ = false;     // by the reading before
  bool command_runs_ = false;  // it is not broken off

  std::jthread thread_;  // last: it uses all of the others
};

}  // namespace absenc::tool
