// SPDX-License-Identifier: Apache-2.0
// Diagnoses an encoder and its connection, from the port upwards. Each finding is data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"

namespace absenc::client {

/// Kinds of findings, in the order of the diagnosis.
enum class FindingKind : std::uint8_t {
  // The port
  port_missing,
  port_forbidden,
  port_in_use,
  port_unsuitable,
  port_is_modem,
  port_rate,
  port_lost,
  port_failed,
  latency_timer,
  direction_unswitched,
  // The bus
  can_bus_off,
  can_not_acknowledged,
  can_errors,
  // The line
  never_silent,
  line_inverted,
  wrong_baud,
  wrong_spi_mode,
  clock_too_fast,
  miso_stuck,
  wrong_echo,
  wrong_address,
  other_protocol,
  only_echo,
  modem_answers,
  no_answer,
  baud_pattern,
  // The frames: what an adapter or its driver does to bytes, then what the line does
  byte_before,
  byte_after,
  flow_control,
  newline_translated,
  telnet_doubled,
  seven_bits,
  nul_lost,
  two_answer,
  extra_bytes,
  bytes_missing,
  same_address,
  wrong_settings,
  other_checksum,
  contradictory,
  always_damaged,
  damaged_bits,
  damaged_bursts,
  sometimes_damaged,
  sometimes_silent,
  comes_and_goes,
  requests_damaged,
  refused,
  counter_stands,
  // The time
  reply_late,
  sometimes_late,
  reply_slow,
  // The reports of the encoder
  starting,
  alarm,
  status,
  position_invalid,
  // The position
  position_noise,
  position_jumps,
  position_frozen,
  turns_stand,
  stuck_bits,
};

/// How serious a finding is.
enum class Severity : std::uint8_t {
  note,     ///< information, no action needed
  warning,  ///< the encoder works, but not as well as it could, or not for long
  fault,    ///< the encoder does not work, or its values cannot be trusted
};

/// A finding, as data and in words.
struct Finding {
  FindingKind finding_kind{};  ///< The fault that was found.
  std::string_view id{};       ///< Identifier of the kind, as "only_echo".
  Severity severity{};         ///< How serious it is.
  std::string evidence{};      ///< What was observed.
  std::string cause{};         ///< The most probable cause.
  std::string action{};        ///< What the user should do.

  /// Returns "only_echo: EVIDENCE. Likely: CAUSE. Try: ACTION", on one line.
  [[nodiscard]] std::string sentence() const;
};

/// Extent of the readings' reports. A property that no reading reports cannot be called good.
struct Reported {
  std::size_t alarms = 0;  ///< Number of readings that report every alarm of the protocol.
  std::size_t valid = 0;   ///< Number of readings that report a valid position.
  std::string missing{};   ///< Names of alarms that no reading reports, as "over_speed, over_heat".
};

/// Measurements of the readings and of the line.
struct Measured {
  Time time{};          ///< Time from the first to the last reading.
  double failures = 1;  ///< Upper limit of the share of failed readings, 0 to 1, at 95 % confidence (Wilson).
  Time quickest{};      ///< Shortest time from the end of a request to the end of its good reply; 0: not known.
  Time slowest{};       ///< Longest time from the end of a request to the end of its good reply; 0: not known.
  double rate = 0;      ///< Good readings per second; 0: not known.
  /// Echo of the adapter: "echo seen", "no echo", or the setting, "echo=off"; "": the line has none.
  std::string echo{};
  /// Latency of the connection, from the latency timer or the setting latency=; nothing: not known.
  std::optional<Time> latency{};
  bool turned = false;  ///< Whether positions were also read while the shaft was turned.
};

/// Result of `doctor`: its findings, and the measurements behind them.
struct Examination {
  std::vector<Finding> findings{};  ///< Findings, the first one to mend first.
  std::size_t tried = 0;            ///< Number of attempts to read.
  std::size_t good = 0;             ///< Number of good readings.
  Reported reported{};              ///< What the encoder reported about itself.
  Measured measured{};              ///< What was measured on the line.
  bool complete = true;             ///< False if the diagnosis was interrupted.

  /// Returns whether no finding needs to be mended.
  [[nodiscard]] bool healthy() const;
  /// Returns the first finding to mend; null if none.
  [[nodiscard]] const Finding* first() const;
  /// Returns one line, "good: ..." or "first: ...".
  [[nodiscard]] std::string verdict() const;
};

/// Length of the diagnosis, and its callbacks.
struct DoctorChoices {
  std::size_t readings = 100'000;        ///< Greatest number of readings.
  Time limit = std::chrono::seconds(3);  ///< Time limit of the readings.
  Time turning{};                        ///< Time of further readings while the user turns the shaft by hand; 0: none.
  std::function<void(const std::string& what)> progress{};  ///< Called with the present step.
  /// Polled all the time; once it returns true, the diagnosis ends with Cancelled. Empty: never.
  std::function<bool()> over{};
};

/// Returns "note", "warning" or "fault".
[[nodiscard]] std::string_view name_of(Severity severity);
/// Returns the identifier of the kind, as "only_echo".
[[nodiscard]] std::string_view id_of(FindingKind finding_kind);

/// Diagnoses an encoder from the port upwards, by readings; never writes to the encoder. `text` and `settings` are
/// those of `open`. A port that does not open is a finding. Throws UsageError, Cancelled.
[[nodiscard]] Examination examine(std::string_view text, std::span<const std::string> settings = {},
                                  const DoctorChoices& choices = {});

}  // namespace absenc::client
