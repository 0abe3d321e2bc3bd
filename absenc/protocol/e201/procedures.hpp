// SPDX-License-Identifier: Apache-2.0
// What the E201-9S is asked in several steps, each as README.md has it. `Found` is what comes of it.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/protocol/author/line.hpp"
#include "absenc/protocol/e201/frame.hpp"

namespace absenc::e201 {

using Line = author::LineOf<Protocol>;

/// `4`. When nothing usable comes, the firmware is asked: before 1.16 it is `unsupported`, otherwise `4` is sent once
/// more.
struct Samples {
  Reading reading{};
  std::uint64_t samples = 0;
};
author::Procedure read(Line& line, Samples& found);

/// Version, serial number, supply and clock. Only the version must be answered; what is not has no text.
inline constexpr std::array info_letters{letter::version, letter::serial, letter::supply, letter::clock};
struct Info {
  std::array<Reply, info_letters.size()> replies{};
};
author::Procedure inform(Line& line, Info& found);

/// What was asked for afterwards, and its reply.
struct ReadBack {
  Request request{};
  Reply reply{};
};
/// `M`, 1 to 8 or kHz, and `m`, which must show it (cross_check_failed).
author::Procedure set_clock(Line& line, ReadBack& found, Arguments arguments);
/// `n` or `f`, then `e` after the supply had its time: where a voltage can be read it must agree (cross_check_failed).
author::Procedure switch_supply(Line& line, ReadBack& found, bool on);
/// `z`: what `?` gives counts from here. The encoder must stand still (invalid_argument), and `?` must be 0 then
/// (cross_check_failed).
author::Procedure set_zero(Line& line, ReadBack& found);

/// Reads frames at each clock, emits after each what was found so far, and sets the clock back, also after an error and
/// after `abort`.
struct Sweep {
  unsigned frames = 0;  // to be read at each clock
  std::array<unsigned, clocks_khz.size()> valid{};
  unsigned measured = 0;  // clocks that are done
  unsigned previous = 0;  // before the sweep; 0: not known yet
  unsigned left = 0;      // what was set last; 0: nothing
  bool restored = false;
  bool aborted = false;

  /// The middle of the longest run of clocks at which all frames were good; 0: there is none.
  [[nodiscard]] unsigned recommended() const;
};
author::Procedure sweep_clocks(Line& line, Sweep& sweep, Arguments arguments);

}  // namespace absenc::e201
