// SPDX-License-Identifier: Apache-2.0
// Connects to an encoder on any kind of line, runs the commands of its unit, and explains failures.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/client/port/link.hpp"
#include "absenc/client/trouble.hpp"
#include "absenc/host/latch_time.hpp"
#include "absenc/host/session.hpp"

namespace absenc::client {

/// The result of a command; valid until the next command.
struct Outcome {
  Error error = Error::none;
  std::string_view detail{};
  std::string_view advice{};         // what to try; "": the advice of the error
  bool aborted = false;              // ended early by a signal, without changing the encoder
  const Reading* reading = nullptr;  // null if the command failed or reads no position
  Change change{};                   // state of the change, for a command that changes the encoder
};

class Connection {
 public:
  /// Returns a connection that is not open yet. Without `open` it opens the port of the address and writes changes to
  /// the journal (journal.hpp), except those of sim:.
  [[nodiscard]] static std::unique_ptr<Connection> make(const EncoderAddress& uri, OpenLink open = {});
  /// Returns an open connection. Throws as `connect`.
  [[nodiscard]] static std::unique_ptr<Connection> open(const EncoderAddress& uri);
  virtual ~Connection() = default;

  /// Opens the port, also again after `disconnect`; counters and statistics continue. Throws os::Failure, UsageError.
  virtual void connect() = 0;
  virtual void disconnect() = 0;
  [[nodiscard]] virtual bool connected() const = 0;
  /// Returns hints on how to improve the port, one sentence each.
  [[nodiscard]] virtual const std::vector<std::string>& notes() const = 0;

  // The following members require an open connection, except for counters and statistics.

  /// Reads the position with all alarms that the unit reports, or runs the command that the address gives instead.
  /// `take` selects among positions that an encoder sends by itself. Throws UsageError if the unit has no position.
  virtual Outcome read(host::Take take = host::Take::newest) = 0;
  /// Runs a command. Calls `on_emit` for each result but the last; `report` then has that result. If the command sets a
  /// value by which the encoder is reached, the connection uses the new value from then on.
  virtual Outcome run(const Command& command, Arguments arguments, const std::function<void()>& on_emit = {}) = 0;
  /// Gives the journal the value that the next changing command overwrites, so that it is not read again.
  void know_before(std::int64_t value) { known_before_ = value; }
  /// Returns the state of the last changing command, also if it threw.
  [[nodiscard]] virtual const Change& change() const = 0;
  /// Passes the fields of the last outcome and its reading to `sink`.
  virtual void report(FieldSink& sink) const = 0;
  /// After `run` threw: passes the values that the encoder was left with; none for most commands.
  virtual void report_left(FieldSink& sink) const = 0;
  /// Explains the failure of the last outcome.
  [[nodiscard]] virtual Trouble trouble(const Outcome& outcome) const = 0;
  /// Returns the interval, by the port's clock, in which the encoder latched the last position.
  [[nodiscard]] virtual host::LatchTime latch_time() const = 0;
  /// Returns whether the last position was compared with another one and the fastest shaft can have moved between them.
  [[nodiscard]] virtual bool confirmed() const = 0;
  [[nodiscard]] virtual const host::Counters& counters() const = 0;
  [[nodiscard]] virtual const host::Latencies& latencies() const = 0;
  /// Returns the last bad exchanges, the newest first.
  [[nodiscard]] virtual std::vector<BadExchangeText> bad_exchanges() const = 0;
  /// Returns the number of bytes or frames sent and received so far.
  [[nodiscard]] virtual std::uint64_t items() const = 0;
  /// Returns the open link, for other conversations while this connection runs none.
  [[nodiscard]] virtual Link lend() const = 0;
  /// Returns the time of the clock of the readings.
  [[nodiscard]] virtual Time now() = 0;

  /// Makes waiting throw os::Ended as soon as `over` returns true, also if the line is never silent. Empty: never.
  virtual void end_when(std::function<bool()> over) = 0;

  /// Uses these options from now on without opening the port again, after the encoder's own settings were changed.
  virtual void set_options(const Options& options);

  [[nodiscard]] const EncoderAddress& uri() const { return uri_; }
  [[nodiscard]] const Unit& unit() const { return *uri_.unit; }

 protected:
  explicit Connection(const EncoderAddress& uri) : uri_(uri) {}
  [[nodiscard]] std::optional<std::int64_t> take_known_before() { return std::exchange(known_before_, std::nullopt); }

 private:
  std::optional<std::int64_t> known_before_{};
  EncoderAddress uri_;
};

/// Reads the alarms: by the command for alarms if the unit has one that these options allow, otherwise by `read`.
/// Throws EncoderFailure, Failure, and as Connection::run.
[[nodiscard]] Reading read_alarms(Connection& connection);

/// Runs a command and passes its fields to `sink`. Throws EncoderFailure, and as Connection::run.
void run_into(Connection& connection, const Command& command, Arguments arguments, FieldSink& sink);

}  // namespace absenc::client
