// SPDX-License-Identifier: Apache-2.0
// A virtual encoder that whoever opens it finds as a real one: for tests of programs that read encoders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Where it is found.
struct EmulateChoices {
  std::string link{};                  ///< a path that leads to the pseudo-terminal; "": only that itself
  std::optional<std::uint16_t> tcp{};  ///< listens there on 127.0.0.1 as well; 0: on a free port
  std::string can{};                   ///< CAN: instead of an adapter this interface, "can0"
};

/// How often the virtual encoder looked at whether its host keeps a rule of the document, which it names when it is
/// broken.
struct RuleCount {
  std::string_view rule{};   ///< The rule, in words.
  std::uint64_t looked = 0;  ///< Number of times that the rule was checked.
  std::uint64_t broken = 0;  ///< Number of times that the host broke the rule.
};

/// What hosts sent to the virtual encoder. Frames that are for no such encoder (CAN) are not counted.
struct RequestCounts {
  std::uint64_t good = 0;      ///< requests of the document, also for other encoders on the line
  std::uint64_t bad = 0;       ///< runs of bytes that are none, and damaged characters, since the first good one
  std::uint64_t before = 0;    ///< the same before it, once there was one
  std::string first_bad = {};  ///< of `bad`, as it was on the wire
};

/// Serves in a thread of its own until it is destroyed. What is done to it is so when the call returns; any thread may.
class Emulation {
 public:
  /// As `emulate`.
  Emulation(std::string_view text, const EmulateChoices& choices);
  /// Moves the emulation; the other one may only be destroyed or assigned to.
  Emulation(Emulation&&) noexcept;
  /// Moves the emulation; the other one may only be destroyed or assigned to.
  Emulation& operator=(Emulation&&) noexcept;
  ~Emulation();

  /// The pseudo-terminal, or the link to it: of an encoder on a CAN bus that of an slcan adapter, or the name
  /// of its interface.
  [[nodiscard]] const std::string& path() const;
  /// 0 without.
  [[nodiscard]] std::uint16_t tcp_port() const;
  /// To open it by: "tformat:/dev/pts/3", "raa38-can:slcan:/dev/pts/3", without the options.
  [[nodiscard]] std::string address() const;
  /// Returns the unit that is emulated.
  [[nodiscard]] const Unit& unit() const;
  /// Returns the options of the virtual encoder.
  [[nodiscard]] const Options& options() const;

  /// Switches the virtual encoder off: it sends no replies until `power_on`.
  void power_off();
  /// `real`: with the document's start-up time.
  void power_on(bool real = false);
  /// By the names of the unit; throws UsageError, which names the nearest.
  void raise_alarm(std::string_view name);
  /// Ends the cause of an alarm. An alarm that the encoder latches stays until a host clears it.
  void lower_alarm(std::string_view name);
  /// "temperature", "battery" ... as `absenc list` has them, in their units. Throws UsageError.
  void set_condition(std::string_view name, std::int64_t value);
  /// "corrupt", "drop" ... as those of `emulate --fault`: how often its replies are damaged from now on, 0 to 1. The
  /// other kinds stay. Throws UsageError.
  void set_fault(std::string_view kind, double rate);
  /// None of any kind.
  void clear_faults();

  /// How often its replies had a fault of this kind.
  [[nodiscard]] std::uint64_t fault_count(std::string_view kind) const;
  /// Requests that were answered.
  [[nodiscard]] std::uint64_t answer_count() const;
  /// Rules of the document that the host broke, and the first of them; "": none.
  [[nodiscard]] std::uint32_t violations() const;
  /// Returns the first rule that the host broke, in words; empty: none.
  [[nodiscard]] std::string first_violation() const;
  /// Every rule that was looked at: the host did what it is about.
  [[nodiscard]] std::vector<RuleCount> rule_counts() const;
  /// Returns how many requests the virtual encoder received, answered and refused.
  [[nodiscard]] RequestCounts request_counts() const;

 private:
  struct Service;
  std::unique_ptr<Service> service_;
};

/// `text` is what stands behind `sim:`, "tformat?model=23-bit&motion=rpm=60&fault=corrupt=0.01". Of what goes over
/// characters or CAN. Throws UsageError, os::Failure.
[[nodiscard]] inline Emulation emulate(std::string_view text, const EmulateChoices& choices = {}) {
  return {text, choices};
}

}  // namespace absenc::client
