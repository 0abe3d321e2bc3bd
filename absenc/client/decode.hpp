// SPDX-License-Identifier: Apache-2.0
// Decodes a capture into rows: the requests and replies of a line with their times.
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

/// Properties of a capture and of the encoder in it. A property that is not set is detected in the capture, or has its
/// default.
struct DecodeChoices {
  /// Channels of the wires, as "D0" or "clock=D0"; one entry may hold several, separated by commas.
  std::vector<std::string> channels{};
  unsigned raw_channels = 0;  ///< Number of channels in a file of raw samples; 0: the file is of another kind.
  std::uint64_t samples_per_second = 0;  ///< Samples per second of a file that states no rate; 0: not given.
  double baud = 0;                       ///< Baud rate of the line, in bits per second; 0: the unit's, or detected.
  /// Parity of the line; without a value the parity of the unit, or the parity detected in the capture.
  std::optional<Parity> parity{};
  std::string model{};                 ///< Name of a model; empty: the first that fits `options`.
  std::vector<std::string> options{};  ///< Options of the unit, as "name=value".
};

/// An input range of rows, mostly in the order of the end of their frames: a request without a reply may follow later
/// rows. Rows are produced while the file is read, so its size is unlimited. Other threads decode the file up to about
/// 2500 rows ahead of the caller.
///
/// Columns: `time_s` (`tick` in a capture without times), `end_s` (`end_tick`), `kind` ("exchange", "request", "reply",
/// "noise"), `request` and `reply` (bytes; text for CAN and clocked links, as "1FF:022B" and "0001"), `turnaround_us`,
/// `angle_deg` (`position_mm` for linear encoders), then each field of the unit under its name, and `error` with
/// `message`. In a good row `error` is empty, and `message` has only a remark, if any. The position and the
/// fields are empty in a row with an error, of noise, or of a frame that is cut off or undocumented.
///
/// If a reply does not carry the alarms, they come from an earlier reply of the same encoder, until a request is
/// unanswered, clears alarms or resets the turns. Without such a reply, the fields of the alarms and of the position
/// that depends on them are `Unknown`, and `angle_deg` is empty.
class Decoded {
 public:
  /// Type of the values in the range.
  using value_type = Row;
  /// Iterator over the range.
  using Iterator = InputIterator<Decoded>;

  /// Opens the file `path`, like `decode`.
  Decoded(const std::string& path, std::string_view protocol, const DecodeChoices& choices);
  /// Moves the decoder; afterwards the other object may only be destroyed or assigned to.
  Decoded(Decoded&&) noexcept;
  /// Moves the decoder; afterwards the other object may only be destroyed or assigned to.
  Decoded& operator=(Decoded&&) noexcept;
  /// Ends the decoding threads, even in the middle of the file.
  ~Decoded();

  /// Waits for the first row and returns an iterator to it, at the end if there is no row; call it once. Throws
  /// UsageError, Failure or, after `cancel`, Cancelled, as every later step does.
  [[nodiscard]] Iterator begin();
  /// Returns the end of the range, for comparison with an iterator.
  [[nodiscard]] static Iterator::End end() { return {}; }
  /// Returns the present row, or null at the end of the range. The row is valid until `advance`.
  [[nodiscard]] const Row* current() const { return row_; }
  /// Moves to the next row and waits until it is decoded, or moves to the end of the range.
  void advance();
  /// Cancels from any thread: a caller that waits for a row, now or later, gets the exception Cancelled.
  void cancel();

  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const;
  /// Returns sentences about damaged or missing parts of the file and about detected properties. They are complete when
  /// the range has ended.
  [[nodiscard]] const std::vector<std::string>& notes() const;

 private:
  struct Parts;

  std::unique_ptr<Parts> parts_;
  const Row* row_ = nullptr;
};

/// Decodes the capture `path` and returns its rows: a sigrok session, VCD or CSV, a binary export of Saleae Logic 2,
/// raw samples, a candump log, or bytes as text. Throws UsageError, Failure.
[[nodiscard]] inline Decoded decode(const std::string& path, std::string_view protocol,
                                    const DecodeChoices& choices = {}) {
  return {path, protocol, choices};
}

}  // namespace absenc::client
