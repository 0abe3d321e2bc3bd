// SPDX-License-Identifier: Apache-2.0
// What a protocol is worth on a bad line: its host and its virtual encoder over random faults in virtual time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/share.hpp"

namespace absenc::client {

/// A fault of the line, or of what the encoder sends.
struct LineFault {
  std::string_view name;     ///< Name of the fault, as `--fault` takes it.
  std::string_view meaning;  ///< What the fault does to the line, as a phrase.
  double usual;              ///< its rate when none is given
};

/// Those of `emulate --fault` by the same names, and those that only a line has: bit, burst, double, talker, late.
[[nodiscard]] std::span<const LineFault> line_faults();

/// Which encoder a campaign runs, how long, and with which faults.
struct CampaignChoices {
  std::string model{};                 ///< Name of a model of the unit; empty: its first.
  std::vector<std::string> options{};  ///< "address=3"
  std::vector<std::string> faults{};  ///< "bit=0.001": rates of 0 to 1, those not named 0; none: the usual rates of all
  std::uint64_t exchanges = 100'000;  ///< Number of exchanges, at least 1.
  std::uint64_t seed = 1;             ///< Seed of the faults; the same seed gives the same campaign.
  /// The shaft turns, so many revolutions a minute (of linear encoders so many mm/s), and positions are confirmed as
  /// `absenc read` does it; none: it is put somewhere else before every reading, and none is confirmed.
  std::optional<double> rpm{};
  std::uint32_t maximum_rpm = 0;  ///< that the host is told, or mm/s; 0: as the model says, or as is usual
};

/// What follows from the check's code for replies whose bits are damaged independently at the rate of the fault `bit`,
/// of each reply.
struct CheckWorth {
  unsigned check_bits = 0;     ///< 0: there is no check
  std::size_t frame_bits = 0;  ///< of a reply
  unsigned distance = 0;       ///< errors of fewer bits than this are always seen; 0: more than 8 bits are
  double words = 0;            ///< so many errors of so many bits are not
  double unseen = 0;           ///< damaged, and the checksum is right
  double taken = 0;            ///< damaged, and with all checks taken for good with another position
  double taken_deviation = 0;  ///< standard deviation of `taken`, which is drawn by chance
};

/// Counts of confirmed positions, right and wrong.
struct Guarded {
  Share confirmed{};       ///< readings: that were presented as confirmed
  Share wrong{};           ///< of these: the position is not that of the shaft when it was taken
  Share alone{};           ///< positions that passed every check of their frames: that are wrong, confirmed or not
  double let_through = 0;  ///< computed: how many wrong ones frame checks and limit together let through
};

/// Result of a campaign: what was read, and what of it was wrong.
struct CampaignResult {
  std::string protocol{};       ///< Identifier of the unit.
  std::string model{};          ///< or ""
  std::uint64_t readings = 0;   ///< Number of readings, failed ones included.
  std::uint64_t exchanges = 0;  ///< requests, or where none are sent frames
  std::uint64_t damaged = 0;    ///< replies damaged by any fault
  Share failed{};               ///< exchanges that ended with an error
  Share given_up{};             ///< readings that ended with one, after all attempts
  Share recovered{};            ///< readings that ended well after an attempt that did not
  Share wrong{};                ///< exchanges: a position was taken that is not the encoder's
  Share changed{};  ///< exchanges: a request that was misheard changed the encoder; after it another took its place
  Share older{};    ///< exchanges: that was an earlier position, of a frame sent before the request
  std::optional<Guarded> guarded{};   ///< of a shaft that turns
  std::optional<CheckWorth> worth{};  ///< none where the check has more than 16 bits, is no linear one, or CAN's
  double seconds = 0;                 ///< of processor time that the exchanges took
};

/// One core. Throws UsageError.
[[nodiscard]] CampaignResult campaign(std::string_view protocol, const CampaignChoices& choices = {});

}  // namespace absenc::client
