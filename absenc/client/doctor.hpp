// SPDX-License-Identifier: Apache-2.0
// What is wrong with an encoder, or with the way to it: looked for from the port up, each finding as data.
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

/// What can be found, in the order in which it is looked for.
enum class Ailment : std::uint8_t {
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
  // What the encoder says
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

enum class Severity : std::uint8_t {
  note,     // good to know
  warning,  // it works, but less well than it could, or not for long
  fault,    // it does not work, or what it says is not to be trusted
};

/// Which of them, as data and in words.
struct Finding {
  Ailment ailment{};       ///< The fault that was found.
  std::string_view id{};   ///< "only_echo"
  Severity severity{};     ///< How serious it is.
  std::string evidence{};  ///< what was seen
  std::string cause{};     ///< what is most likely behind it
  std::string action{};    ///< what to do

  /// "only_echo: EVIDENCE. Likely: CAUSE. Try: ACTION", on one line.
  [[nodiscard]] std::string sentence() const;
};

/// How much the readings reported: what none of them reports cannot be called good.
struct Reported {
  std::size_t alarms = 0;  ///< readings that report every alarm of the protocol
  std::size_t valid = 0;   ///< readings that report that their position holds
  std::string missing{};   ///< the alarms that no reading reports, as "over_speed, over_heat"
};

/// How the readings were come by.
struct Measured {
  Time time{};          ///< from the first to the last of them
  double failures = 1;  ///< the share of failures is below it, at 95 % confidence (Wilson)
  Time quickest{};      ///< from the end of a request to the end of its reply; 0: not known
  Time slowest{};       ///< of good ones
  double rate = 0;      ///< good readings a second; 0: not known
  std::string echo{};   ///< of the adapter: "echo seen", "no echo", "echo=off" as it was said; "": a line that has none
  std::optional<Time> latency{};  ///< of the way, as the latency timer or latency= says; nothing: not known
  bool turned = false;            ///< the position was looked at while the shaft was turned
};

/// Result of `doctor`: its findings, and the measurements behind them.
struct Examination {
  std::vector<Finding> findings{};  ///< in the order in which they are to be mended
  std::size_t tried = 0;            ///< readings
  std::size_t good = 0;             ///< of them
  Reported reported{};              ///< What the encoder reported about itself.
  Measured measured{};              ///< What was measured on the line.
  bool complete = true;             ///< false: it was interrupted

  /// Whether nothing is to be mended.
  [[nodiscard]] bool healthy() const;
  /// The first thing to mend; null: nothing is.
  [[nodiscard]] const Finding* first() const;
  /// "good: ..." or "first: ...", one line.
  [[nodiscard]] std::string verdict() const;
};

/// What `doctor` may do and how long it looks.
struct DoctorChoices {
  std::size_t readings = 100'000;        ///< at most
  Time limit = std::chrono::seconds(3);  ///< how long it reads
  Time turning{};                        ///< how long the shaft is then read while somebody turns it by hand; 0: not
  std::function<void(const std::string& what)> progress{};  ///< what is done now
  std::function<bool()> over{};  ///< true: it ends with Cancelled. Asked all the time. Empty: never
};

/// "note", "warning", "fault"
[[nodiscard]] std::string_view name_of(Severity severity);
/// "only_echo"
[[nodiscard]] std::string_view id_of(Ailment ailment);

/// Looks from the port up and reads; nothing is ever written to the encoder. `text` and `settings` as those of `open`.
/// A port that does not open is a finding. Throws UsageError, Cancelled.
[[nodiscard]] Examination examine(std::string_view text, std::span<const std::string> settings = {},
                                  const DoctorChoices& choices = {});

}  // namespace absenc::client
