// SPDX-License-Identifier: Apache-2.0
// Procedures of the E201-9S with several exchanges; README.md describes each.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/e201/frame.hpp"

namespace absenc::e201 {

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

/// Results of a procedure. Values that were not requested or not answered stay empty.
struct InterfaceResults {
  Reading reading{};                         ///< The position.
  std::uint64_t samples = 0;                 ///< the samples from which `reading` was decoded
  std::optional<Text> command{};             ///< Value of the field `command`, if there is one.
  std::optional<Text> version{};             ///< Value of the field `version`, if there is one.
  std::optional<Text> serial{};              ///< Value of the field `serial`, if there is one.
  std::optional<Text> supply{};              ///< Value of the field `supply`, if there is one.
  std::optional<std::int64_t> clock{};       ///< Value of the field `clock`, if there is one.
  std::optional<std::int64_t> width{};       ///< Value of the field `width`, if there is one.
  std::optional<std::int64_t> counts{};      ///< Value of the field `counts`, if there is one.
  std::optional<std::string_view> advice{};  ///< recommended clocks, if another clock is set

  // Results of clock-sweep.
  unsigned frames = 0;  ///< frames to read at each clock
  /// Number of valid frames at each clock.
  std::array<unsigned, clocks_khz.size()> valid{};
  unsigned measured = 0;  ///< number of clocks that were completed
  unsigned previous = 0;  ///< clock before the sweep; 0: unknown
  unsigned left = 0;      ///< clock that was set last; 0: none
  bool restored = false;  ///< Whether the clock was put back.
  bool aborted = false;   ///< Whether the command was aborted.

  /// Stores the reply line to the command `asked`.
  constexpr void take(std::uint8_t asked, const Reply& reply) {
    if (asked == letter::version) version = reply.text;
    if (asked == letter::serial) serial = reply.text;
    if (asked == letter::supply) supply = reply.text;
    if (asked == letter::clock) clock = reply.number;
    if (asked == letter::width) width = reply.number;
    if (asked == letter::decimal || asked == letter::hexadecimal) counts = reply.number;
  }
  /// Stores the clock that is set, and the advice if the maker recommends another for this encoder.
  constexpr void take_clock(const Format& format, std::int64_t now) {
    clock = now;
    if (format.kind == Kind::resolute && (now < resolute_slowest || now > resolute_fastest)) {
      advice = "280 or 560 kHz are recommended for Renishaw Resolute";
    }
  }
  /// Returns the middle of the longest run of clocks at which all frames were valid; 0 if there is none.
  [[nodiscard]] unsigned recommended() const;
};

/// Reads a position with `4`. Without a usable reply, reads the firmware version: before 1.16 the error is unsupported,
/// otherwise `4` is sent once more.
author::Procedure read(Dialog& dialog, InterfaceResults& found);
/// Reads version, serial number, supply and clock. Only the version is mandatory.
author::Procedure read_info(Dialog& dialog, InterfaceResults& found);
/// Sets the clock with `M` and reads it back with `m`. Argument: 1 to 8, or kHz. Error also: cross_check_failed
/// (another clock is set).
author::Procedure set_clock(Dialog& dialog, InterfaceResults& found, Arguments arguments);
/// Switches the supply with `n` or `f`, waits and reads it with `e`. Error also: cross_check_failed (the voltage in the
/// reply contradicts).
author::Procedure switch_supply(Dialog& dialog, InterfaceResults& found, bool on);
/// Sets the zero of `?` with `z`. Errors also: not_still (the encoder moves), invalid_argument (its position is
/// invalid), cross_check_failed (`?` is not near 0 afterwards).
author::Procedure set_zero(Dialog& dialog, InterfaceResults& found);
/// Reads frames at each clock and emits the results after each. Restores the old clock, after an error and after
/// `abort` too.
author::Procedure sweep_clocks(Dialog& dialog, InterfaceResults& found, Arguments arguments);

/// Advice about a stream of the interface.
inline constexpr std::string_view check_stream =
    "check that it is an E201-9S and does not stream (`absenc run ... stream-off` ends it)";

/// Explains `error` of `reply` to `request`; an empty reply is a timeout. The advice is from the document.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

}  // namespace absenc::e201
