// SPDX-License-Identifier: Apache-2.0
// Connects to an encoder, runs the commands of its unit, and explains failures.
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

/// The result of a command; valid until the next command runs.
struct Outcome {
  Error error = Error::none;
  std::string_view detail{};
  std::string_view advice{};  // advice of the unit on what to try; "": the general advice for the error applies
  // whether a signal ended the command early, after the command had restored the encoder
  bool aborted = false;
  const Reading* reading = nullptr;  // the reading; null if the command failed or reads no position
  // whether the encoder was changed, for a command that changes it; the state `none` for other commands
  Change change{};
};

class Connection {
 public:
  /// Returns a connection that is not open yet.
  [[nodiscard]] static std::unique_ptr<Connection> make(const EncoderAddress& uri, OpenLink open = {});
  /// Makes a connection, opens its port and returns it. Throws the exceptions of `connect`.
  [[nodiscard]] static std::unique_ptr<Connection> open(const EncoderAddress& uri);
  virtual ~Connection() = default;

  /// Opens the port, or shares that of another connection. Throws os::Failure, UsageError, Failure.
  virtual void connect() = 0;
  virtual void disconnect() = 0;
  [[nodiscard]] virtual bool connected() const = 0;
  [[nodiscard]] virtual const std::vector<std::string>& notes() const = 0;
  /// Returns the clock rate in Hz of the last transfer; 0 if the port makes no clock, or is not connected.
  [[nodiscard]] virtual std::uint32_t clock_rate() const = 0;

  // `read`, `run`, `trouble`, `lend` and `now` require an open connection.

  /// Reads the position. Throws UsageError and the exceptions of the port.
  virtual Outcome read(host::Take take = host::Take::newest) = 0;
  /// Runs a command. Calls `on_emit` at each intermediate result, so that `on_emit` can call `report`, which passes
  /// this result to a sink.
  virtual Outcome run(const Command& command, Arguments arguments, const std::function<void()>& on_emit = {}) = 0;
  /// Stores the value that the next changing command overwrites, for the journal.
  void know_before(std::int64_t value) { known_before_ = value; }
  /// Returns the state of the last changing command, also if the command threw an exception.
  [[nodiscard]] virtual const Change& change() const = 0;
  /// Passes the fields and the reading of the last command's outcome to `sink`.
  virtual void report(FieldSink& sink) const = 0;
  /// Passes the settings of the encoder that a failed command has left changed to `sink`.
  virtual void report_left(FieldSink& sink) const = 0;
  /// Returns a description of a failed command. `outcome` must be the outcome of the last command.
  [[nodiscard]] virtual Trouble trouble(const Outcome& outcome) const = 0;
  /// Returns bounds of the time at which the last position was latched, by the port's clock.
  [[nodiscard]] virtual host::LatchTime latch_time() const = 0;
  /// Returns whether the last position agrees with the position that was read before it.
  [[nodiscard]] virtual bool confirmed() const = 0;
  [[nodiscard]] virtual const host::Counters& counters() const = 0;
  [[nodiscard]] virtual const host::Latencies& latencies() const = 0;
  /// Returns the stored bad exchanges, the newest first.
  [[nodiscard]] virtual std::vector<BadExchangeText> bad_exchanges() const = 0;
  /// Returns the number of bytes or frames that were sent and received so far.
  [[nodiscard]] virtual std::uint64_t items() const = 0;
  /// Returns the open link, for other conversations while this connection runs none.
  [[nodiscard]] virtual Link lend() const = 0;
  /// Returns the present time of the port's clock, by which the times of readings are given.
  [[nodiscard]] virtual Time now() = 0;

  /// Sets a function that is polled during waits; true ends them with os::Ended. Empty: none.
  virtual void end_when(std::function<bool()> over) = 0;

  /// Sets the options with which the encoder is reached from the next command on, without opening the port again.
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

/// Returns a reading with the alarms. Throws EncoderFailure, Failure, and as Connection::run.
[[nodiscard]] Reading read_alarms(Connection& connection);

/// Runs a command and passes its result to `sink`. Throws EncoderFailure, and as Connection::run.
void run_into(Connection& connection, const Command& command, Arguments arguments, FieldSink& sink);

/// Returns the advice that explains how to find out whether an encoder was changed by a command. `before`: how the
/// encoder was reached before the command.
[[nodiscard]] std::string advice_to_look(const EncoderAddress& before, const Command& command, Arguments arguments);

}  // namespace absenc::client
