// SPDX-License-Identifier: Apache-2.0
// Reads one encoder repeatedly in a thread of its own, and returns copies of its state.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absenc/client/encoder/parts.hpp"

namespace absenc::tool {

using namespace client;

/// The state of a watched encoder at one moment.
struct Snapshot {
  enum class State : std::uint8_t {
    opening,  // the port is not open yet
    live,     // the last reading is good, and not older than the longer of three periods and 0.5 s
    silent,   // the last reading is good, but older than the longer of three periods and 0.5 s
    failing,  // the last attempt to read failed
    lost,     // the port was open and was lost
    paused,   // the user has paused the readings
    ended,    // the thread has given up reading; `message` has the reason
  };

  State state = State::opening;
  Time age{};  // age of the last reading; before the first reading, time since the watch started
  bool has_reading = false;
  Sample last{};  // last reading; valid if `has_reading` is true; it is the present position only in the state `live`
  std::string message{};  // reason of the states failing, lost and ended; in opening "" before the first attempt failed
  std::string notice{};   // message to the user, such as the result of the last command
  host::Counters counters{};
  std::uint64_t readings = 0;
  std::uint64_t losses = 0;
  std::uint64_t restarts = 0;  // number of times that the position started again; see Encoder::restarts
  double rate = 0;             // number of readings per second, as measured
  Time median{};               // median of the times from a request to the end of its reply
  Time percentile_99{};
  Time longest{};
  // Lines of text about the last readings and events, the newest last; empty unless `snapshot` was called with
  // `details`.
  std::vector<std::string> trace{};
  // last bad exchanges, the newest first; empty unless `snapshot` was called with `details`
  std::vector<BadExchangeText> bad{};
  // Texts "name value" of the fields that are not in the line about the reading; empty unless `snapshot` was called
  // with `details`.
  std::vector<std::string> fields{};
};

[[nodiscard]] std::string_view name_of(Snapshot::State state);

/// Watches one encoder in a thread of its own, because its port blocks.
class Watch {
 public:
  /// Begins to watch an encoder. The first reading is `offset` after the start; `rate`: readings per second, 0: as fast
  /// as possible.
  Watch(std::string name, const EncoderAddress& uri, double rate, Time offset);
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Ends the thread and waits for it; a running command is not aborted.
  void stop();

  [[nodiscard]] Snapshot snapshot(bool details) const;
  void pause(bool paused);
  /// Lets the thread, if it has not ended, run a command without arguments. Snapshot::notice gets the result.
  void run(const Command& command);
  /// Sets Snapshot::notice to `text`.
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

  mutable std::mutex mutex_;  // guards the members from `changed_` to `command_`
  std::condition_variable_any changed_;
  Snapshot known_;
  Time known_at_{};  // time of the last reading; before the first reading, time of the start
  std::deque<std::string> lines_;
  bool paused_ = false;
  std::optional<Command> command_;

  // The members from `next_summary_` to `command_runs_` are used only by the thread that reads.
  Time next_summary_{};
  Time next_line_{};
  std::uint32_t alarms_ = 0;
  std::uint32_t alarms_reported_ = 0;
  bool restarted_ = false;     // whether the continuous position started again at the previous reading
  bool command_runs_ = false;  // whether a command is running, which must not be aborted

  std::jthread thread_;  // declared last, because the thread uses all other members of this object
};

}  // namespace absenc::tool
