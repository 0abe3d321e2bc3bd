// SPDX-License-Identifier: Apache-2.0
// An opened encoder: runs the commands of its unit, whatever its link carries, and explains what went wrong.
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

/// How a command ended; valid until the next one.
struct Outcome {
  Error error = Error::none;
  std::string_view detail{};
  std::string_view advice{};         // "": that of the error
  bool aborted = false;              // ended early because of a signal, and left the encoder as it was
  const Reading* reading = nullptr;  // null when it failed, or is no position
  Change change{};                   // of a command that changes the encoder
};

class Connection {
 public:
  /// Not connected yet.
  /// Without `open`: over its own way, and its changes are kept in the journal (journal.hpp), but for those of sim:.
  [[nodiscard]] static std::unique_ptr<Connection> make(const EncoderAddress& uri, OpenLink open = {});
  /// Connected. Throws as `connect`.
  [[nodiscard]] static std::unique_ptr<Connection> open(const EncoderAddress& uri);
  virtual ~Connection() = default;

  /// Opens the way to it, again after `disconnect`; counters and statistics go on. Throws os::Failure, UsageError.
  virtual void connect() = 0;
  virtual void disconnect() = 0;
  [[nodiscard]] virtual bool connected() const = 0;
  /// What could be better about the port, a sentence each.
  [[nodiscard]] virtual const std::vector<std::string>& notes() const = 0;

  // All of the following only while it is connected, but for counters and statistics.

  /// The position, with all the alarms the unit can tell, or what the address says is read in its place; of those that
  /// an encoder transmits by itself, which. Throws UsageError when the unit has none.
  virtual Outcome read(host::Take take = host::Take::newest) = 0;
  /// `on_emit` is called for each result but the last; `report` then tells of it. What reaches the encoder by what the
  /// command sets reaches it by the new value from now on.
  virtual Outcome run(const Command& command, Arguments arguments, const std::function<void()>& on_emit = {}) = 0;
  /// For the journal: what the next command that changes the encoder will overwrite, so that it is not read again.
  void know_before(std::int64_t value) { known_before_ = value; }
  /// The state of the last command that changes the encoder, also when it has thrown.
  [[nodiscard]] virtual const Change& change() const = 0;
  /// The fields of the last outcome, and its reading.
  virtual void report(FieldSink& sink) const = 0;
  /// After `run` threw: what the encoder was left with. Nothing for most commands.
  virtual void report_left(FieldSink& sink) const = 0;
  /// Of the last outcome.
  [[nodiscard]] virtual Trouble trouble(const Outcome& outcome) const = 0;
  /// Between which times of its clock the last position was latched.
  [[nodiscard]] virtual host::LatchTime latch_time() const = 0;
  /// Whether the last position was compared with another, and agreed as well as the fastest shaft allows.
  [[nodiscard]] virtual bool confirmed() const = 0;
  [[nodiscard]] virtual const host::Counters& counters() const = 0;
  [[nodiscard]] virtual const host::Latencies& latencies() const = 0;
  /// The last bad exchanges, the newest first.
  [[nodiscard]] virtual std::vector<BadExchangeText> bad_exchanges() const = 0;
  /// Bytes or frames over the line so far, both ways.
  [[nodiscard]] virtual std::uint64_t items() const = 0;
  /// Its way, open as it is, for others who converse over it while this does not.
  [[nodiscard]] virtual Link lend() const = 0;
  /// The clock of the readings.
  [[nodiscard]] virtual Time now() = 0;

  /// What waits on the line throws os::Ended from the moment on in which `over` is true, also when the line is never
  /// silent. Empty: never.
  virtual void end_when(std::function<bool()> over) = 0;

  /// From now on, without opening it again: it was set to something else itself.
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

/// A reading for its alarms: by the command that reads them, where the unit has one and these options allow it, else as
/// `read`. Throws EncoderFailure, Failure, and as Connection::run.
[[nodiscard]] Reading read_alarms(Connection& connection);

/// The fields that a command tells, into `sink`. Throws EncoderFailure, and as Connection::run.
void run_into(Connection& connection, const Command& command, Arguments arguments, FieldSink& sink);

}  // namespace absenc::client
