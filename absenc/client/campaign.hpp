// SPDX-License-Identifier: Apache-2.0
// Measures how well a protocol detects errors on a bad line: host and virtual encoder exchange frames under random
// faults, in virtual time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/share.hpp"

namespace absenc::client {

/// A fault of the line, or of the bytes that the encoder sends.
struct LineFault {
  std::string_view name;     ///< Name of the fault, as `--fault` takes it.
  std::string_view meaning;  ///< What the fault does to the line, as a phrase.
  double usual;              ///< Default rate, 0 to 1.
};

/// Returns the faults of `emulate --fault`, under the same names, and those of the line only: bit, burst, double,
/// talker, late.
[[nodiscard]] std::span<const LineFault> line_faults();

/// The encoder of a campaign, its length, and its faults.
struct CampaignChoices {
  std::string model{};                 ///< Name of a model of the unit; empty: its first.
  std::vector<std::string> options{};  ///< Options of the unit, as "address=3".
  /// Faults with their rates from 0 to 1, as "bit=0.001"; others have rate 0. Empty: the default rates of all faults.
  std::vector<std::string> faults{};
  std::uint64_t exchanges = 100'000;  ///< Number of exchanges, at least 1.
  std::uint64_t seed = 1;             ///< Seed of the faults; the same seed gives the same campaign.
  /// Speed of the shaft in revolutions per minute (mm/s for linear encoders), with positions confirmed as `absenc read`
  /// does. Without a value the shaft moves to another place before every reading and positions are not confirmed.
  std::optional<double> rpm{};
  /// Maximum speed that the host assumes, in revolutions per minute or mm/s; 0: that of the model, or the usual one.
  std::uint32_t maximum_rpm = 0;
};

/// Computed strength of the frame check, for replies whose bits are damaged independently at the rate of the fault
/// `bit`. All rates are per reply.
struct CheckWorth {
  unsigned check_bits = 0;     ///< Width of the check in bits; 0: none.
  std::size_t frame_bits = 0;  ///< Length of a reply, in bits.
  unsigned distance = 0;       ///< Hamming distance: all errors of fewer bits are detected; 0: more than 8 bits.
  double words = 0;            ///< Number of undetected error patterns of `distance` bits.
  double unseen = 0;           ///< Rate of damaged replies with a correct checksum.
  double taken = 0;            ///< Rate of damaged replies that pass all checks with a wrong position.
  double taken_deviation = 0;  ///< Standard deviation of `taken`, which is estimated from random samples.
};

/// Counts of confirmed positions, right and wrong.
struct Guarded {
  Share confirmed{};  ///< Share of readings that were confirmed.
  /// Share of confirmed readings with a position that the shaft did not have when it was sampled.
  Share wrong{};
  Share alone{};           ///< Share of wrong positions, confirmed or not, among those that passed every frame check.
  double let_through = 0;  ///< Computed number of wrong positions that pass both frame checks and confirmation.
};

/// Result of a campaign: numbers of exchanges and shares of errors.
struct CampaignResult {
  std::string protocol{};       ///< Identifier of the unit.
  std::string model{};          ///< Model of the encoder; "" if the unit has none.
  std::uint64_t readings = 0;   ///< Number of readings, failed ones included.
  std::uint64_t exchanges = 0;  ///< Number of requests, or of frames where the encoder sends unsolicited.
  std::uint64_t damaged = 0;    ///< Number of replies that a fault damaged.
  Share failed{};               ///< Share of exchanges that ended with an error.
  Share given_up{};             ///< Share of readings that ended with an error after all attempts.
  Share recovered{};            ///< Share of readings that succeeded after a failed attempt.
  Share wrong{};                ///< Share of exchanges that returned a position which is not the encoder's.
  /// Share of exchanges in which a damaged request changed the encoder; a fresh encoder replaced it afterwards.
  Share changed{};
  Share older{};  ///< Share of exchanges that returned an earlier position, from a frame sent before the request.
  std::optional<Guarded> guarded{};  ///< Confirmed positions; only with `rpm`.
  /// Computed strength of the check; without a value if the check has more than 16 bits, is not linear, or is that of
  /// CAN.
  std::optional<CheckWorth> worth{};
  double seconds = 0;  ///< Processor time of all exchanges, in seconds.
};

/// Runs a campaign on one core. Throws UsageError.
[[nodiscard]] CampaignResult campaign(std::string_view protocol, const CampaignChoices& choices = {});

}  // namespace absenc::client
