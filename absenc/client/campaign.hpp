// SPDX-License-Identifier: Apache-2.0
// Measures how well a protocol detects errors on a bad line, simulated in virtual time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/share.hpp"

namespace absenc::client {

/// A kind of fault that a campaign injects.
struct LineFault {
  std::string_view name;     ///< Name of the fault, as `--fault` takes it.
  std::string_view meaning;  ///< Damage that the fault does to the line, as a phrase.
  double usual;              ///< Default rate of the fault, 0 to 1.
};

/// Returns all faults that a campaign can inject.
[[nodiscard]] std::span<const LineFault> line_faults();

/// Settings of a campaign.
struct CampaignChoices {
  std::string model{};                 ///< Name of a model of the unit; empty: the first model that fits `options`.
  std::vector<std::string> options{};  ///< Options of the unit, as "address=3".
  /// Faults with their rates from 0 to 1, as "bit=0.001"; empty: the default rates of all faults.
  std::vector<std::string> faults{};
  /// Number of exchanges after which the campaign ends, at least 1; it makes a few more to finish its last reading.
  std::uint64_t exchanges = 100'000;
  std::uint64_t seed = 1;  ///< Seed of faults and shaft positions; the same seed gives the same counts.
  /// Speed of the shaft in revolutions per minute, or mm/s for linear encoders; the host then confirms each position by
  /// a second reading. Without a value, the shaft moves to another place before every reading, and positions are not
  /// confirmed.
  std::optional<double> rpm{};
  /// Highest shaft speed, in rev/min or mm/s, that the host assumes when it confirms positions; used only with `rpm`.
  /// 0: the default.
  std::uint32_t maximum_rpm = 0;
};

/// Computed strength of the frame check (the checksum) against independent bit errors. Each share refers to all
/// replies.
struct CheckWorth {
  unsigned check_bits = 0;     ///< Width of the checksum in bits; 0: frames have no checksum.
  std::size_t frame_bits = 0;  ///< Length of a reply, in bits.
  /// Hamming distance of the checksum: the checksum detects every error of fewer wrong bits, if it covers all of these
  /// bits; 0: the distance is above 8.
  unsigned distance = 0;
  double words = 0;  ///< Number of patterns of exactly `distance` wrong bits that the checksum does not detect.
  /// Share of all replies with wrong bits only among those that the checksum covers, and yet with a correct checksum.
  double unseen = 0;
  double taken = 0;  ///< Share of all replies that are damaged, yet accepted with a wrong position.
  /// Standard deviation of `taken`, the share of accepted damaged replies, which is estimated from random samples.
  double taken_deviation = 0;
};

/// Shares of confirmed and of wrong positions, in a campaign with a turning shaft.
struct Guarded {
  Share confirmed{};  ///< Share of readings whose position a second reading confirmed.
  /// Share of confirmed readings with a position that the shaft did not have within 2 ms of the reading's latch time.
  /// Readings of an encoder that a fault has changed are left out.
  Share wrong{};
  Share alone{};  ///< Share of wrong positions, confirmed or not, among the readings that passed every frame check.
  /// Computed number of wrong positions that pass the frame checks and are then confirmed by a second reading.
  double let_through = 0;
};

/// Result of a campaign: numbers of exchanges and shares of errors. In a campaign with a turning shaft (`rpm`),
/// `recovered`, `wrong` and `older` are not counted.
struct CampaignResult {
  std::string protocol{};       ///< Identifier of the unit.
  std::string model{};          ///< Name of the encoder's model; "": none.
  std::uint64_t readings = 0;   ///< Number of readings, failed ones included.
  std::uint64_t exchanges = 0;  ///< Number of requests, or of frames if the encoder sends unsolicited frames.
  std::uint64_t damaged = 0;    ///< Number of replies that a fault damaged.
  Share failed{};               ///< Share of exchanges that ended with an error.
  Share given_up{};             ///< Share of readings that ended with an error after all attempts.
  Share recovered{};            ///< Share of readings that succeeded after a failed attempt.
  /// Share of exchanges with a wrong position. Includes earlier positions (`older`), but no exchange after which the
  /// encoder proved to be changed (`changed`).
  Share wrong{};
  /// Share of exchanges (with `rpm`: of readings) after which a damaged request proved to have changed the encoder.
  Share changed{};
  /// Share of exchanges with an earlier position, from a frame that was sent before the request.
  Share older{};
  std::optional<Guarded> guarded{};  ///< Shares of confirmed and wrong positions; without a value unless `rpm` was set.
  /// Computed strength of the frame check; without a value if it cannot be computed, as on CAN.
  std::optional<CheckWorth> worth{};
  /// Processor time of the process during the exchanges, in seconds; the time to compute the strength of the checksum
  /// (`worth`) is not included.
  double seconds = 0;
};

/// Runs a campaign on one core. Throws UsageError.
[[nodiscard]] CampaignResult campaign(std::string_view protocol, const CampaignChoices& choices = {});

}  // namespace absenc::client
