// SPDX-License-Identifier: Apache-2.0
// What the E201-9S is asked in several steps, each as README.md has it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/e201/frame.hpp"

namespace absenc::e201 {

using Dialog = author::DialogOf<Protocol>;

/// What comes of it: what was not asked or not answered is not there.
struct Found {
  Reading reading{};
  std::uint64_t samples = 0;  // of which it is
  std::optional<Text> command{};
  std::optional<Text> version{};
  std::optional<Text> serial{};
  std::optional<Text> supply{};
  std::optional<std::int64_t> clock{};
  std::optional<std::int64_t> width{};
  std::optional<std::int64_t> counts{};
  std::optional<std::string_view> advice{};  // of the clock that is set

  // clock-sweep
  unsigned frames = 0;  // to be read at each clock
  std::array<unsigned, clocks_khz.size()> valid{};
  unsigned measured = 0;  // clocks that are done
  unsigned previous = 0;  // before the sweep; 0: not known yet
  unsigned left = 0;      // what was set last; 0: nothing
  bool restored = false;
  bool aborted = false;

  /// The reply to `asked`, which is answered by a line.
  constexpr void take(std::uint8_t asked, const Reply& reply) {
    if (asked == letter::version) version = reply.text;
    if (asked == letter::serial) serial = reply.text;
    if (asked == letter::supply) supply = reply.text;
    if (asked == letter::clock) clock = reply.number;
    if (asked == letter::width) width = reply.number;
    if (asked == letter::decimal || asked == letter::hexadecimal) counts = reply.number;
  }
  /// The clock is this one: what the maker of the encoder recommends, where that is another.
  constexpr void take_clock(const Format& format, std::int64_t now) {
    clock = now;
    if (format.kind == Kind::resolute && (now < resolute_slowest || now > resolute_fastest)) {
      advice = "280 or 560 kHz are recommended for Renishaw Resolute";
    }
  }
  /// The middle of the longest run of clocks at which all frames were good; 0: there is none.
  [[nodiscard]] unsigned recommended() const;
};

/// `4`. When nothing usable comes, the firmware is asked: before 1.16 it is `unsupported`, otherwise `4` is sent once
/// more.
author::Procedure read(Dialog& dialog, Found& found);
/// Version, serial number, supply and clock. Only the version must be answered.
author::Procedure inform(Dialog& dialog, Found& found);
/// `M`, 1 to 8 or kHz, and `m`, which must show it (cross_check_failed).
author::Procedure set_clock(Dialog& dialog, Found& found, Arguments arguments);
/// `n` or `f`, then `e` after the supply had its time: where a voltage can be read it must agree (cross_check_failed).
author::Procedure switch_supply(Dialog& dialog, Found& found, bool on);
/// `z`: what `?` gives counts from here. The encoder must stand still (invalid_argument), and `?` must be 0 then
/// (cross_check_failed).
author::Procedure set_zero(Dialog& dialog, Found& found);
/// Reads frames at each clock, emits after each what was found so far, and sets the clock back, also after an error and
/// after `abort`.
author::Procedure sweep_clocks(Dialog& dialog, Found& found, Arguments arguments);

inline constexpr std::string_view check_stream =
    "check that it is an E201-9S and does not stream (`absenc run ... stream-off` ends it)";

/// What is wrong with `reply` to `request`, which Protocol::decode refuses with `error`, or with none (timeout); and
/// what the document says to do about it.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

}  // namespace absenc::e201
