// SPDX-License-Identifier: Apache-2.0
// The observations of an encoder and its port, which the judges evaluate.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/doctor.hpp"
#include "absenc/client/port/runner.hpp"
#include "absenc/host/echo.hpp"
#include "absenc/host/speed_limit.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/port_facts.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// A setting that was tried instead of the user's.
struct Trial {
  FindingKind finding_kind{};  // the finding if this setting helps
  std::string said{};          // the user's setting, "baud=115200"
  std::string setting{};       // the setting tried, "baud=9600"
  std::size_t good = 0;
  std::size_t tried = 0;
  std::size_t good_as_said = 0;  // good readings with the user's setting in the same turns
  std::size_t tried_as_said = 0;
  std::string command{};  // other_protocol: the command that reads the encoder
};

/// Why the port did not open, or was lost.
struct Refusal {
  os::Failure::Kind kind{};
  std::string sentence{};
  os::Failure::Bus bus = os::Failure::Bus::unknown;
  os::Failure::Holder holder = os::Failure::Holder::unknown;
};

struct Observations {
  PortKind place = PortKind::serial;
  std::string port{};  // path of a serial port
  os::PortFacts facts{};
  std::optional<os::LineCounts> damage{};  // errors that the UART counted during the examination
  std::optional<Refusal> refusal{};
  std::vector<std::uint8_t> unsolicited{};  // bytes received before the first request
  Time listened{};
  bool never_silent = false;  // the line was never silent while listening
  std::vector<Attempted> readings{};
  std::vector<Attempted> turned{};  // readings while the shaft was turned by hand
  std::uint64_t line_errors = 0;    // number of error frames of a CAN bus
  std::uint64_t late = 0;           // number of replies after their timeout
  Time lateness{};                  // delay of the latest of them
  std::uint64_t overfull = 0;       // number of good replies that were followed by more items
  std::vector<std::uint8_t> overfull_example{};
  std::size_t most_behind = 0;  // greatest number of items after one of them
  std::vector<Trial> trials{};
  host::EchoMode echo_said{};     // echo mode that the user set
  host::EchoMode echo{};          // echo mode that was detected
  std::optional<Time> latency{};  // latency that the user set
  Time woken_late{};              // greatest wake-up delay of this computer during the examination
  host::SpeedLimit limit{};       // speed limit of the encoder
  std::string clash{};            // "address 3", if all replies of that address are damaged
  bool complete = true;
};

/// Judges the observations; findings are in the order of their kinds.
[[nodiscard]] Examination judge(const Unit& unit, const Options& options, const Observations& seen);

/// Returns the most likely finding for a single failed reading. `usually_good`: other readings mostly succeed; `late`:
/// replies arrived after their timeout. The evidence may be incomplete.
[[nodiscard]] Finding finding_of(const Unit& unit, const Options& options, PortKind place, const Attempted& last,
                                 bool usually_good, bool late);

}  // namespace absenc::client
