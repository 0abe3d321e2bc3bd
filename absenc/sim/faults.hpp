// SPDX-License-Identifier: Apache-2.0
// A virtual encoder with injected faults.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "absenc/link/step.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::sim {

/// Kind of an injected fault.
enum class FaultKind : std::uint8_t {
  drop,             ///< one character of the reply is lost
  corrupt,          ///< 1 to 3 bits of the reply are flipped
  truncate,         ///< the reply stops at a random character, at least one is sent
  delay,            ///< the reply is sent late
  echo,             ///< the bytes of the request are sent before the reply
  garbage,          ///< 1 to 4 random characters are sent before the reply
  silence,          ///< the reply is not sent
  repeat,           ///< the reply is sent twice
  request_corrupt,  ///< 1 to 3 bits of a received byte are flipped before the device gets it
};

/// Names of the fault kinds, indexed by FaultKind.
inline constexpr std::array<std::string_view, 9> fault_names{"drop",    "corrupt", "truncate", "delay",          "echo",
                                                             "garbage", "silence", "repeat",   "request_corrupt"};

/// Number of injected faults of each kind, indexed by FaultKind.
using FaultCounts = std::array<std::uint64_t, fault_names.size()>;

/// Probabilities of the injected faults, and the `delay` of late replies.
struct FaultRates {
  /// Probability of each fault, 0 to 1, indexed by FaultKind.
  std::array<double, fault_names.size()> rates{};
  Time delay = std::chrono::microseconds(200);  ///< additional delay of a late reply
  /// Number of bytes that one character carries, 1 or 2: drop, truncate and garbage remove or add whole characters.
  std::uint8_t character_bytes = 1;

  /// Returns the probability of faults of the kind `kind`, as a reference that can be assigned to.
  constexpr double& operator[](FaultKind kind) { return rates[static_cast<std::size_t>(kind)]; }
  /// Returns the probability of faults of the kind `kind`, 0 to 1.
  constexpr double operator[](FaultKind kind) const { return rates[static_cast<std::size_t>(kind)]; }
};

/// A kind of fault with its probability.
struct FaultRate {
  FaultKind kind;  ///< Kind of the fault.
  double rate;     ///< Probability of the fault, 0 to 1.
};

/// Parses text like `corrupt=0.01`. Throws std::invalid_argument.
[[nodiscard]] FaultRate parse_fault(std::string_view text);

/// Flips 1 to 3 different random bits of `bytes`, which must not be empty.
void flip_bits(std::span<std::uint8_t> bytes, Random& random);

/// A machine that stands between a line and the machine of a device, and injects faults. The device must outlive it.
///
/// All faults but `request_corrupt` strike what the device sends: on character links a reply, on clocked links the bits
/// that the device drives. A reply that a fault makes longer or later does not follow the device's own timing.
class FaultyDevice final : public Machine<std::uint8_t> {
 public:
  /// Injects faults between `device` and its line. The same seed gives the same faults.
  FaultyDevice(Machine<std::uint8_t>& device, const FaultRates& rates, std::uint64_t seed);

  /// Processes an event that the port reports.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns the next step that the port must carry out.
  Step<std::uint8_t> next(Time now) override;

  /// Sets the probabilities of faults, from the next reply or received byte on.
  void set_rates(const FaultRates& rates) { rates_ = rates; }
  /// Returns the number of injected faults of the kind `kind`.
  [[nodiscard]] std::uint64_t count(FaultKind kind) const { return counts_[static_cast<std::size_t>(kind)]; }
  /// Returns the number of injected faults of each kind, indexed by FaultKind.
  [[nodiscard]] const FaultCounts& counts() const { return counts_; }
  /// Returns the number of replies with at least one fault; `request_corrupt` does not count.
  [[nodiscard]] std::uint64_t damaged_replies() const { return damaged_replies_; }

 private:
  bool strikes(FaultKind kind);
  bool damage(Step<std::uint8_t>& reply, Time now);
  void receive(const Event<std::uint8_t>& event);

  Machine<std::uint8_t>& device_;
  FaultRates rates_;
  Random random_;
  FaultCounts counts_{};
  std::uint64_t damaged_replies_ = 0;

  std::vector<std::uint8_t> request_;  // the first 256 bytes that were received since the last reply
  std::vector<std::uint8_t> reply_;
  // bytes of the last received event in the form in which the device got them, perhaps damaged
  std::vector<std::uint8_t> received_;
  bool request_damaged_ = false;  // the request was damaged, so the device may answer while the host still sends
  // Whether received bytes are ignored, because the device is sending a changed reply and expects no request.
  bool ignores_line_ = false;
  // time of the last received byte that was not passed on to the device
  Time last_ignored_at_ = -std::chrono::hours(1);
  Time device_gap_{};          // longest `gap` that the device has requested so far
  Time silent_until_ = never;  // time at which a suppressed reply counts as sent
  Time device_timer_ = never;  // time of the `timer` event that the device has requested
};

}  // namespace absenc::sim
