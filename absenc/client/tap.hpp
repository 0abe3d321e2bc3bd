// SPDX-License-Identifier: Apache-2.0
// Listens to a line on which two others speak, and sends nothing.
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

/// What `tap` decodes, and how.
struct TapChoices {
  std::string protocol{};              ///< "": found out from what is received
  std::string model{};                 ///< Name of a model of the unit; empty: none.
  std::vector<std::string> options{};  ///< "name=value"
  Time duration{};                     ///< 0: until `cancel`, or the end of the input
  std::string record{};                ///< file to write all frames to, which `decode` reads; "": none
  bool replaces = false;               ///< the file of `record` may be there already
};

/// An input range of rows, as `Decoded` has them, in the order in which they ended, each as soon as it is whole. What
/// comes while nobody takes a row is kept. `time_s` is the time of arrival at this computer, since the first byte; how
/// long an encoder took to answer cannot be told from that, so `turnaround_us` is empty.
class Tap {
 public:
  /// Type of the items.
  using value_type = Row;
  /// Iterator of the range.
  using Iterator = InputIterator<Tap>;

  /// Opens `place`, a port with its settings ("/dev/ttyUSB0?baud=115200", "tcp:HOST:PORT"), or "-" for raw bytes from
  /// standard input, and waits until protocol and options are known. A serial port is opened without writing. Throws
  /// os::Failure, UsageError, Failure: no protocol explains what came.
  explicit Tap(const std::string& place, const TapChoices& choices = {});
  /// Moves the tap; the other one may only be destroyed or assigned to.
  Tap(Tap&&) noexcept;
  /// Moves the tap; the other one may only be destroyed or assigned to.
  Tap& operator=(Tap&&) noexcept;
  ~Tap();

  /// Waits for the first row. Once. Throws, as each step does, os::Failure, Failure.
  [[nodiscard]] Iterator begin();
  /// Returns the end of the range.
  [[nodiscard]] static Iterator::End end() { return {}; }
  /// Returns the row at the iterator, or null at the end. It is valid until `advance`.
  [[nodiscard]] const Row* current() const { return row_; }
  /// Waits for the next row.
  void advance();
  /// From any thread: who waits for a row, now or later, gets Cancelled.
  void cancel();

  /// Returns the identifier of the unit.
  [[nodiscard]] std::string_view protocol() const;
  /// "name=value", the fewest that make its options.
  [[nodiscard]] std::vector<std::string> options() const;
  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const;

 private:
  struct Work;

  std::unique_ptr<Work> work_;
  const Row* row_ = nullptr;
};

}  // namespace absenc::client
