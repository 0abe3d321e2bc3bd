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
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Kinds of findings, in the order in which an examination lists them.
enum class FindingKind : std::uint8_t {
  // The following findings are about the port.
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
  // The following findings are about a CAN bus.
  can_bus_off,
  can_not_acknowledged,
  can_errors,
  // The following findings are about the line and the devices that are connected to it.
  never_silent,
  line_inverted,
  wrong_baud,
  wrong_spi_mode,
  clock_too_fast,
  miso_stuck,
  transceiver_missing,
  data_at_rest,
  clock_range,
  wrong_echo,
  wrong_address,
  other_protocol,
  only_echo,
  modem_answers,
  no_answer,
  baud_pattern,
  // The following findings are about damaged frames; the first of them are changes that an adapter or its driver makes.
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
  // The following findings are about replies that come too late or too slowly.
  reply_late,
  sometimes_late,
  reply_slow,
  // The following findings are about states that the encoder reports.
  starting,
  alarm,
  status,
  position_invalid,
  // The following findings are about wrong or implausible positions.
  position_noise,
  position_jumps,
  position_frozen,
  turns_stand,
  turns_jump,
  stuck_bits,
  // The following finding is about the examination itself.
  few_readings,
};

/// Severity of a finding.
enum class Severity : std::uint8_t {
  note,     ///< information, no action needed
  warning,  ///< the encoder works, but not as well as it could, or not for long
  fault,    ///< the encoder does not work, or its values cannot be trusted
};

/// A fault or a note that the diagnosis found, as data and in words.
struct Finding {
  FindingKind finding_kind{};  ///< Kind of the finding.
  std::string_view id{};       ///< Identifier of the kind, as "only_echo".
  Severity severity{};         ///< How serious the finding is.
  std::string evidence{};      ///< Observation that led to the finding, as a sentence.
  std::string cause{};         ///< Most probable cause of the finding.
  std::string action{};        ///< Action that the user should take.

  /// Returns the whole finding on one line: "only_echo: EVIDENCE. Likely: CAUSE. Try: ACTION".
  [[nodiscard]] std::string sentence() const;
};

/// How many readings report alarms and validity.
struct Reported {
  std::size_t alarms = 0;  ///< Number of readings that report, for every alarm, whether it is raised.
  std::size_t valid = 0;   ///< Number of readings that report a valid position.
  std::string missing{};   ///< Names of alarms whose state no reading reports, as "over_speed, over_heat".
};

/// Times, rates and settings that were measured during the diagnosis.
struct Measured {
  Time time{};          ///< Time from the beginning of the first reading to the beginning of the last one.
  double failures = 1;  ///< Upper limit of the share of failed readings, 0 to 1, at 95 % confidence (Wilson).
  Time quickest{};      ///< Shortest time from the end of a request to the end of its good reply; 0: not known.
  Time slowest{};       ///< Longest time from the end of a request to the end of its good reply; 0: not known.
  /// Greatest delay with which this computer itself reacted during the readings; 0: not measured.
  Time computer_late{};
  double rate = 0;  ///< Number of good readings per second; 0: none, or not known.
  /// Echo of the adapter in words, as "no echo", or the user's setting, as "echo=off"; may be "".
  std::string echo{};
  /// Latency of the connection; without a value: not known.
  std::optional<Time> latency{};
  bool turned = false;  ///< Whether positions were also read while the user was to turn the shaft by hand.
};

/// Result of `examine`: its findings, and the measurements behind them.
struct Examination {
  std::vector<Finding> findings{};  ///< Findings, in the order in which the user should mend them.
  std::size_t tried = 0;            ///< Number of attempts to read with the given settings and an untouched shaft.
  std::size_t good = 0;             ///< Number of good readings.
  Reported reported{};              ///< How many readings report alarms and validity.
  Measured measured{};              ///< Times, rates and settings that were measured.
  /// Possible faults that the readings could not show, with the reason, as "a turning shaft (--turn)".
  std::vector<std::string> not_looked_at{};
  bool complete = true;  ///< False if the diagnosis was interrupted.

  /// Returns whether the diagnosis is complete and no finding is a warning or a fault.
  [[nodiscard]] bool healthy() const;
  /// Returns the first of the most severe findings; null if no finding is a warning or a fault.
  [[nodiscard]] const Finding* first() const;
  /// Returns the result on one line, "good: ...", "first: ..." or "interrupted: ...".
  [[nodiscard]] std::string verdict() const;
};

/// A request of the diagnosis with its reply, without the adapter's echo. The frames are valid during the callback.
struct DoctorExchange {
  Time sent{};            ///< Time of the port's clock at which the request ended.
  Time answered_after{};  ///< Time from the end of the request to the beginning of the reply; 0 without a reply.
  Frame request{};        ///< The request; empty: the encoder sends without requests.
  Frame reply{};          ///< The reply; empty: there was none.
};

/// Limits of the diagnosis, and its callbacks.
struct DoctorChoices {
  std::size_t readings = 100'000;  ///< Greatest number of readings of a series with the given settings.
  /// Time limit of a series of readings during which the user leaves the shaft alone.
  Time limit = std::chrono::seconds(3);
  Time turning{};  ///< Time of further readings while the user turns the shaft by hand; 0: none.
  std::function<void(const std::string& what)> progress{};  ///< Called with the step that begins, as a phrase.
  /// Called with each request of the diagnosis and what was received after it. Empty: never.
  std::function<void(const DoctorExchange& exchange)> exchanged{};
  /// Polled during the diagnosis; true ends it. Empty: never.
  std::function<bool()> over{};
};

/// Returns the severity as a word: "note", "warning" or "fault".
[[nodiscard]] std::string_view name_of(Severity severity);
/// Returns the identifier of a kind of finding, as "only_echo".
[[nodiscard]] std::string_view id_of(FindingKind finding_kind);

/// Diagnoses an encoder from the port upwards and returns the result. `text` and `settings` are those of `open`. A port
/// that cannot be opened is a finding. Throws UsageError, Cancelled.
[[nodiscard]] Examination examine(std::string_view text, std::span<const std::string> settings = {},
                                  const DoctorChoices& choices = {});

}  // namespace absenc::client
