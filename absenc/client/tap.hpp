// SPDX-License-Identifier: Apache-2.0
// Listens to the traffic between a host and its encoders, without sending.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/input_range.hpp"
#include "absenc/client/row.hpp"
#include "absenc/core/time.hpp"

namespace absenc::client {

/// Settings of a tap: protocol and options for decoding, duration, and file of the record.
struct TapChoices {
  std::string protocol{};  ///< Identifier of the protocol's unit; "": the protocol is detected from the received bytes.
  std::string model{};     ///< Name of a model; "": the default one. Received bytes may correct its options.
  std::vector<std::string> options{};  ///< Options of the unit, as "name=value".
  Time duration{};                     ///< Time after which the tap ends; 0: no limit.
  /// File to which received bytes are written, in a format that `decode` reads; "": no file.
  std::string record{};
  bool replaces = false;  ///< Whether an existing file `record` may be replaced.
};

/// An input range of rows with the columns of `Decoded`. `time_s` is the time of arrival at this computer since the
/// first byte; it is too coarse for latencies, so `turnaround_us` is empty.
class Tap {
 public:
  /// Type of the values in the range.
  using value_type = Row;
  /// Iterator over the range.
  using Iterator = InputIterator<Tap>;

  /// Opens `place` and waits until protocol and options are known. `place` is a port with its settings, as
  /// "/dev/ttyUSB0?baud=115200" or "tcp:HOST:PORT", or "-" for standard input. Throws os::Failure, os::Interrupted,
  /// UsageError, Failure.
  explicit Tap(const std::string& place, const TapChoices& choices = {});
  /// Moves the tap; afterwards the other object may only be destroyed or assigned to.
  Tap(Tap&&) noexcept;
  /// Moves the tap; afterwards the other object may only be destroyed or assigned to.
  Tap& operator=(Tap&&) noexcept;
  ~Tap();

  /// Waits for the first row and returns an iterator to it; call it once. Throws os::Failure, Failure, os::Interrupted
  /// or Cancelled, as every later step does.
  [[nodiscard]] Iterator begin();
  /// Returns the end of the range, for comparison with an iterator.
  [[nodiscard]] static Iterator::End end() { return {}; }
  /// Returns the present row, or null at the end of the range. The row is valid until `advance`.
  [[nodiscard]] const Row* current() const { return row_; }
  /// Waits until the next row is complete or the range ends, and moves there.
  void advance();
  /// Cancels from any thread: the thread that waits for rows soon gets the exception Cancelled.
  void cancel();

  /// Returns the identifier of the unit with which the tap decodes.
  [[nodiscard]] std::string_view protocol() const;
  /// Returns the options with which the tap decodes, as settings "name=value".
  [[nodiscard]] std::vector<std::string> options() const;
  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const;

 private:
  struct Parts;

  std::unique_ptr<Parts> parts_;
  const Row* row_ = nullptr;
};

}  // namespace absenc::client
