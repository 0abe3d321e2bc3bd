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

/// Properties of a capture and of the encoder in it.
struct DecodeChoices {
  /// Channels of the wires, as "D0" or "clock=D0"; one entry may hold several, as "D0,D1".
  std::vector<std::string> channels{};
  unsigned raw_channels = 0;  ///< Number of channels in a file of raw samples; 0: the file is of another kind.
  std::uint64_t samples_per_second = 0;  ///< Samples per second of a file that states no rate; 0: not given.
  double baud = 0;                       ///< Baud rate of the line, in bits per second; 0: the unit's, or detected.
  /// Parity of the line; without a value: the unit's, or detected.
  std::optional<Parity> parity{};
  std::string model{};                 ///< Name of a model of the unit; empty: the first model that fits `options`.
  std::vector<std::string> options{};  ///< Options of the unit, as "name=value".
};

/// An input range of rows. Other threads decode ahead of the caller.
///
/// Columns: `time_s` (`tick` in a capture without times), `end_s` (`end_tick`), `kind` ("exchange", "request", "reply",
/// "noise"), `request` and `reply` (bytes; text for CAN and clocked links), `turnaround_us`, `angle_deg` (`position_mm`
/// for linear encoders), each field of the unit under its name, `error` and `message`.
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

  /// Waits for the first row and returns an iterator to it; call it once. Throws UsageError, Failure or Cancelled, as
  /// every later step does.
  [[nodiscard]] Iterator begin();
  /// Returns the end of the range, for comparison with an iterator.
  [[nodiscard]] static Iterator::End end() { return {}; }
  /// Returns the present row; null before `begin` and at the end of the range. The row is valid until `advance`.
  [[nodiscard]] const Row* current() const { return row_; }
  /// Moves to the next row and waits until it is decoded, or moves to the end of the range.
  void advance();
  /// Cancels the decoding, from any thread: a waiting caller gets the exception Cancelled.
  void cancel();

  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const;
  /// Returns sentences about the capture; complete when the range has ended.
  [[nodiscard]] const std::vector<std::string>& notes() const;

 private:
  struct Parts;

  std::unique_ptr<Parts> parts_;
  const Row* row_ = nullptr;
};

/// Decodes the capture `path` and returns its rows. Throws UsageError, Failure.
[[nodiscard]] inline Decoded decode(const std::string& path, std::string_view protocol,
                                    const DecodeChoices& choices = {}) {
  return {path, protocol, choices};
}

}  // namespace absenc::client
