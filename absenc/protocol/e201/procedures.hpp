// SPDX-License-Identifier: Apache-2.0
// Procedures of the E201-9S, and their results.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/e201/frame.hpp"

namespace absenc::e201 {

/// Interface by which procedures send commands and await replies.
using Dialog = author::DialogOf<Protocol>;

/// Results of a procedure. Members whose value was not requested or not received stay empty.
struct InterfaceResults {
  Reading reading{};  ///< Position as a reading; empty if no position was read.
  /// Samples from which `reading` was decoded, the first one in the highest bit.
  std::uint64_t samples = 0;
  std::optional<Text> command{};         ///< Text of the command that was sent.
  std::optional<Text> version{};         ///< Firmware version of the interface, as text.
  std::optional<Text> serial{};          ///< Serial number of the interface, as text.
  std::optional<Text> supply{};          ///< State of the encoder's supply, as text.
  std::optional<std::int64_t> clock{};   ///< Number of the MA clock that is set, 1 to 8.
  std::optional<std::int64_t> width{};   ///< Width of the position that `?` returns, in bits.
  std::optional<std::int64_t> counts{};  ///< Position from `?` or `>`, in counts from the interface's zero.
  /// Recommendation of other clocks, if the set clock does not suit the encoder.
  std::optional<std::string_view> advice{};

  // Results of the command clock-sweep.
  unsigned frames = 0;  ///< Number of frames to read at each clock.
  /// Number of valid frames at each clock, in the order of `clocks_khz`.
  std::array<unsigned, clocks_khz.size()> valid{};
  unsigned measured = 0;  ///< Number of clocks whose frames have all been read.
  unsigned previous = 0;  ///< Number of the clock before the sweep; 0: unknown.
  unsigned left = 0;      ///< Number of the clock that the sweep last set, or tried to set; 0: none.
  bool restored = false;  ///< Whether the sweep has restored the clock `previous`.
  bool aborted = false;   ///< Whether the user aborted the sweep.

  /// Stores the value from the reply line to the command `asked`.
  constexpr void take(std::uint8_t asked, const Reply& reply) {
    if (asked == letter::version) version = reply.text;
    if (asked == letter::serial) serial = reply.text;
    if (asked == letter::supply) supply = reply.text;
    if (asked == letter::clock) clock = reply.number;
    if (asked == letter::width) width = reply.number;
    if (asked == letter::decimal || asked == letter::hexadecimal) counts = reply.number;
  }
  /// Stores `now` as the clock that is set, and advice if it does not suit the encoder.
  constexpr void take_clock(const Format& format, std::int64_t now) {
    clock = now;
    if (format.kind == Kind::resolute && (now < resolute_slowest || now > resolute_fastest)) {
      advice = "280 or 560 kHz are recommended for Renishaw Resolute";
    }
  }
  /// Returns the number, 1 to 8, of the clock in the middle of the longest run of clocks at which every frame was
  /// valid; 0: there is no such clock.
  [[nodiscard]] unsigned recommended() const;
};

/// Reads a position with `4`. Error besides those of the exchanges: unsupported (firmware before 1.16).
author::Procedure read(Dialog& dialog, InterfaceResults& found);
/// Reads version, serial number, supply and clock; all but the version may be missing.
author::Procedure read_info(Dialog& dialog, InterfaceResults& found);
/// Sets the clock with `M` and reads it back with `m`. Argument: 1 to 8, or kHz. Errors: those of the exchanges, and
/// cross_check_failed.
author::Procedure set_clock(Dialog& dialog, InterfaceResults& found, Arguments arguments);
/// Switches the encoder's supply, and reads its state. Errors: those of the exchanges, and cross_check_failed.
author::Procedure switch_supply(Dialog& dialog, InterfaceResults& found, bool on);
/// Sets the zero of `?` with `z`. Errors: those of the exchanges, not_still, invalid_argument, cross_check_failed.
author::Procedure set_zero(Dialog& dialog, InterfaceResults& found);
/// Clears the zero of `?` with `a`, and reads the position before and after. Errors: those of the exchanges.
author::Procedure clear_zero(Dialog& dialog, InterfaceResults& found);
/// Reads frames at each clock, and emits the results after each clock; at the end restores the clock that was set
/// before.
author::Procedure sweep_clocks(Dialog& dialog, InterfaceResults& found, Arguments arguments);

/// Advice if the line is never silent or a reply has a wrong length: the interface may stream.
inline constexpr std::string_view check_stream =
    "check that it is an E201-9S and does not stream (`absenc run ... stream-off` ends it)";

/// Returns cause and advice for an error, empty if there are none. An empty request counts as `4`.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

}  // namespace absenc::e201
