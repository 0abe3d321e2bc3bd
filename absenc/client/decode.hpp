// SPDX-License-Identifier: Apache-2.0
// A capture as rows: what was said on a line, request by request, with its times.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/input_range.hpp"
#include "absenc/client/row.hpp"
#include "absenc/link/line.hpp"

namespace absenc::client {

/// What is said of a capture, and of the encoder whose frames are in it. What is left out is found in the capture, or
/// is as the protocol has it.
struct DecodeChoices {
  std::vector<std::string> channels{};   ///< "D0", "clock=D0", or several of them with commas between
  unsigned raw_channels = 0;             ///< 0: it is no file of raw samples
  std::uint64_t samples_per_second = 0;  ///< 0: the file tells
  double baud = 0;                       ///< Rate of the line in bits per second; 0: found in the capture.
  std::optional<Parity> parity{};        ///< Parity of the line; without a value that of the unit.
  std::string model{};                   ///< Name of a model of the unit; empty: none.
  std::vector<std::string> options{};    ///< "name=value"
};

/// An input range of rows, in the order in which they ended, while the file is read: its size does not matter. The file
/// is decoded in other threads, ahead of whoever takes the rows by some thousands of them.
///
/// Columns: `time_s` (of a capture without times `tick`), `end_s` (`end_tick`), `kind` ("exchange", "request", "reply",
/// "noise"), `request` and `reply` (bytes; of CAN and clocked links text, as "1FF:022B" and "0001"), `turnaround_us`,
/// `angle_deg` (of linear encoders `position_mm`), then each field of the unit under its name, and `error` with
/// `message`, which are empty in a good row. A row with an error has no other values than these, its times and frames.
///
/// Where a reply does not carry the alarms, an earlier reply of the same encoder completes them, as
/// long as requests are answered and clear none. Without such a reply, alarms and the position that depends on them are
/// `Unknown`.
class Decoded {
 public:
  /// Type of the items.
  using value_type = Row;
  /// Iterator of the range.
  using Iterator = InputIterator<Decoded>;

  /// As `decode`.
  Decoded(const std::string& path, std::string_view protocol, const DecodeChoices& choices);
  /// Moves the decoder; the other one may only be destroyed or assigned to.
  Decoded(Decoded&&) noexcept;
  /// Moves the decoder; the other one may only be destroyed or assigned to.
  Decoded& operator=(Decoded&&) noexcept;
  /// Ends the threads, also in the middle of the file.
  ~Decoded();

  /// Waits for the first row. Once. Throws, as each step does, UsageError, Failure.
  [[nodiscard]] Iterator begin();
  /// Returns the end of the range.
  [[nodiscard]] static Iterator::End end() { return {}; }
  /// Returns the row at the iterator, or null at the end. It is valid until `advance`.
  [[nodiscard]] const Row* current() const { return row_; }
  /// Goes to the next row.
  void advance();
  /// From any thread: who waits for a row, now or later, gets Cancelled.
  void cancel();

  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const;
  /// When the range has ended: sentences about what is damaged or missing in the file, and what was found out.
  [[nodiscard]] const std::vector<std::string>& notes() const;

 private:
  struct Work;

  std::unique_ptr<Work> work_;
  const Row* row_ = nullptr;
};

/// `path` is a session of sigrok, VCD, CSV or binary export of a logic analyser, a log of candump, or bytes as text.
/// Throws UsageError, Failure.
[[nodiscard]] inline Decoded decode(const std::string& path, std::string_view protocol,
                                    const DecodeChoices& choices = {}) {
  return {path, protocol, choices};
}

}  // namespace absenc::client
