// SPDX-License-Identifier: Apache-2.0
// A virtual encoder that misbehaves on request: damages what a device machine sends, and what it hears.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "absenc/link/step.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::sim {

enum class FaultKind : std::uint8_t {
  drop,             // one byte is lost
  corrupt,          // 1 to 3 bits are flipped
  truncate,         // the reply stops at a random place, after at least one byte
  delay,            // the reply comes late
  echo,             // the request's bytes come before the reply
  garbage,          // 1 to 4 random bytes come before the reply
  silence,          // no reply
  repeat,           // the reply comes twice
  request_corrupt,  // 1 to 3 bits of a byte that the device receives are flipped
};

inline constexpr std::array<std::string_view, 9> fault_names{"drop",    "corrupt", "truncate", "delay",          "echo",
                                                             "garbage", "silence", "repeat",   "request_corrupt"};

/// How often each fault was injected, by FaultKind.
using FaultCounts = std::array<std::uint64_t, fault_names.size()>;

/// How often each fault is injected: 0 to 1, per reply, `request_corrupt` per byte (CAN: frame) received.
struct FaultRates {
  std::array<double, fault_names.size()> rates{};
  Time delay = std::chrono::microseconds(200);  // how late a delayed reply is

  constexpr double& operator[](FaultKind kind) { return rates[static_cast<std::size_t>(kind)]; }
  constexpr double operator[](FaultKind kind) const { return rates[static_cast<std::size_t>(kind)]; }
};

struct FaultRate {
  FaultKind kind;
  double rate;
};

/// `corrupt=0.01`. Throws std::invalid_argument with a sentence that names the known kinds or the allowed range.
[[nodiscard]] FaultRate parse_fault(std::string_view text);

/// Stands between the line and a device machine, which must outlive it. The same seed gives the same faults.
///
/// For character links; on clocked ones the bits that the device drives are damaged. A reply that a fault made longer
/// or later is not the device's own timing: until it is sent, the device does not hear what comes (a real one would not
/// either), so that it does not take it for a host that breaks the rules.
class FaultyDevice final : public Machine<std::uint8_t> {
 public:
  FaultyDevice(Machine<std::uint8_t>& device, const FaultRates& rates, std::uint64_t seed);

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;

  /// From the next reply on.
  void set_rates(const FaultRates& rates) { rates_ = rates; }
  /// How many faults of this kind were injected.
  [[nodiscard]] std::uint64_t count(FaultKind kind) const { return counts_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] const FaultCounts& counts() const { return counts_; }
  /// Replies with at least one fault.
  [[nodiscard]] std::uint64_t damaged_replies() const { return damaged_replies_; }

 private:
  bool strikes(FaultKind kind);
  bool damage(Step<std::uint8_t>& reply, Time now);
  void flip_bits(std::span<std::uint8_t> bytes);
  void hear(const Event<std::uint8_t>& event);

  Machine<std::uint8_t>& device_;
  FaultRates rates_;
  Random random_;
  FaultCounts counts_{};
  std::uint64_t damaged_replies_ = 0;

  std::vector<std::uint8_t> request_;  // since the last reply
  std::vector<std::uint8_t> reply_;
  std::vector<std::uint8_t> heard_;  // what the device is told
  bool misheard_ = false;            // the request was changed: the device may answer while the host still sends
  bool deaf_ = false;                // a stretched reply, or one to a changed request, is pending or going on
  Time unheard_at_ = -std::chrono::hours(1);  // the last byte that came while it was deaf
  Time device_gap_{};                         // the pause after which the device takes a request for ended
  Time silent_until_ = never;                 // a suppressed reply counts as sent then
  Time device_timer_ = never;                 // what the device itself waits for
};

}  // namespace absenc::sim
