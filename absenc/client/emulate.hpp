// SPDX-License-Identifier: Apache-2.0
// Runs a virtual encoder on a port that programs open like a real one.
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

/// Port on which programs reach the virtual encoder.
struct EmulateChoices {
  std::string link{};  ///< Path of a symbolic link to the pseudo-terminal; "": no link.
  /// TCP port of 127.0.0.1 on which the encoder also listens; 0: a free one; no value: none.
  std::optional<std::uint16_t> tcp{};
  /// Network interface of a CAN encoder, as "can0"; "": an emulated slcan adapter.
  std::string can{};
};

/// How often the virtual encoder checked a rule of the document, and how often it was broken.
struct RuleCount {
  std::string_view rule{};   ///< The rule, in words.
  std::uint64_t looked = 0;  ///< Number of times that the virtual encoder checked the rule.
  std::uint64_t broken = 0;  ///< Number of times that the host broke the rule.
};

/// Counts of what the virtual encoder received from hosts.
struct RequestCounts {
  /// Number of good requests; those for other encoders on the line may count, too.
  std::uint64_t good = 0;
  /// Number of received items that are no good request. Items are CAN frames, characters with a line error, and series
  /// of bytes without a pause. The count starts again at the first good request.
  std::uint64_t bad = 0;
  /// Number of bad requests before the first good request; 0 until there is a good one.
  std::uint64_t before = 0;
  std::string first_bad = {};  ///< Text of the first item counted in `bad`; "" for a damaged character or none.
};

/// A running virtual encoder, served by its own thread; several threads may call its functions. Functions that change
/// or ask the encoder throw the exception that ended the service, if any.
class Emulation {
 public:
  /// Starts the virtual encoder, as `emulate` does.
  Emulation(std::string_view text, const EmulateChoices& choices);
  /// Moves the emulation; afterwards the other object may only be destroyed or assigned to.
  Emulation(Emulation&&) noexcept;
  /// Moves the emulation; afterwards the other object may only be destroyed or assigned to.
  Emulation& operator=(Emulation&&) noexcept;
  ~Emulation();

  /// Returns the path of the pseudo-terminal or of the link to it, or the name of the CAN interface.
  [[nodiscard]] const std::string& path() const;
  /// Returns the TCP port on which the encoder listens; 0 if there is none.
  [[nodiscard]] std::uint16_t tcp_port() const;
  /// Returns the encoder's address for `open`, without options, as "tformat:/dev/pts/3".
  [[nodiscard]] std::string address() const;
  /// Returns the unit that is emulated.
  [[nodiscard]] const Unit& unit() const;
  /// Returns the options with which the virtual encoder was started.
  [[nodiscard]] const Options& options() const;

  /// Switches the virtual encoder off: it sends no replies until `power_on`.
  void power_off();
  /// Switches the virtual encoder on; with `real` it starts up as slowly as a real one.
  void power_on(bool real = false);
  /// Raises an alarm by its name in the unit. Throws UsageError.
  void raise_alarm(std::string_view name);
  /// Ends the cause of an alarm; an alarm that the encoder latches stays. Throws UsageError.
  void lower_alarm(std::string_view name);
  /// Sets a condition to a value in its unit of measure (Condition::unit), as "temperature" to 85 degC. Throws
  /// UsageError.
  void set_condition(std::string_view name, std::int64_t value);
  /// Sets the rate, 0 to 1, of a fault such as "corrupt". Throws UsageError.
  void set_fault(std::string_view kind, double rate);
  /// Sets the rate of every fault to 0.
  void clear_faults();

  /// Returns how often this fault was injected. Throws UsageError.
  [[nodiscard]] std::uint64_t fault_count(std::string_view kind) const;
  /// Returns how many answers the encoder has given; unsolicited frames may count, too.
  [[nodiscard]] std::uint64_t answer_count() const;
  /// Returns how often the host broke a rule of the document.
  [[nodiscard]] std::uint32_t violations() const;
  /// Returns the first rule that the host broke, in words; empty: none.
  [[nodiscard]] std::string first_violation() const;
  /// Returns, for each rule that was checked, how often it was checked and how often the host broke it.
  [[nodiscard]] std::vector<RuleCount> rule_counts() const;
  /// Returns how many good and bad requests the virtual encoder received.
  [[nodiscard]] RequestCounts request_counts() const;

 private:
  struct Running;
  std::unique_ptr<Running> running_;
};

/// Starts a virtual encoder and returns it. `text` is an address without `sim:`, as "tformat?model=23-bit". The link of
/// the unit must carry characters or CAN frames. Throws UsageError, os::Failure.
[[nodiscard]] inline Emulation emulate(std::string_view text, const EmulateChoices& choices = {}) {
  return {text, choices};
}

}  // namespace absenc::client
