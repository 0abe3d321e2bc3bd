// SPDX-License-Identifier: Apache-2.0
// The observations of an encoder and its port, from which the judges derive their findings.
#pragma once

#include <algorithm>
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
  FindingKind finding_kind{};  // kind of the finding that is reported if readings succeed with `setting`
  std::string said{};          // the user's setting, "baud=115200"
  std::string setting{};       // the other setting, "baud=9600"
  std::size_t good = 0;
  std::size_t tried = 0;
  // number of good readings with the user's setting, which were taken in turns with the readings with `setting`
  std::size_t good_as_said = 0;
  std::size_t tried_as_said = 0;
  std::string command{};  // address that reads the encoder, if `identify` found it; "": it did not
};

/// Readings with one clock rate.
struct ClockTrial {
  std::uint32_t rate = 0;  // clock rate in Hz
  // number of readings without an error and, if the shaft rested, with about the same position as the readings before
  // this trial
  std::size_t good = 0;
  std::size_t tried = 0;
  bool is_set = false;  // whether `rate` is the clock rate that the user has set
};

/// The reason why the port could not be opened, or was lost.
struct Refusal {
  os::Failure::Kind kind{};
  std::string sentence{};
  os::Failure::Bus bus = os::Failure::Bus::unknown;
  os::Failure::Holder holder = os::Failure::Holder::unknown;
};

struct Observations {
  PortKind place = PortKind::serial;
  std::string port{};  // path of the serial port; "": the port is of another kind
  os::PortFacts facts{};
  // errors of characters that the UART counted during the examination; nothing: not known
  std::optional<os::LineCounts> damage{};
  std::optional<Refusal> refusal{};
  // bytes that were received while nothing was requested; only about the first 4096 are stored
  std::vector<std::uint8_t> unsolicited{};
  Time listened{};
  // whether bytes were received in at least 4 of the 5 periods of listening before the first request
  bool never_silent = false;
  // whether bytes were received in at least two of these periods that do not follow one another, or some time after the
  // last reading
  bool sends_unasked = false;
  std::vector<Attempted> readings{};
  // failed requests that the host repeated within a reading, so that the reading itself may be good
  std::vector<Attempted> repeated{};
  std::vector<Attempted> damaged_frames{};  // damaged frames of a stream; the stream is cut into frames at its pauses
  std::size_t doubled = 0;                  // number of frames of a stream that arrived twice; 0 if only a few did
  bool is_stream = false;                   // whether the encoder sends frames without requests
  std::vector<Attempted> turned{};          // readings during which the user was to turn the shaft by hand
  // number of line errors that the port reported; on CAN, the number of error frames
  std::uint64_t line_errors = 0;
  std::uint64_t late = 0;  // number of replies that began after their timeout or answered an older request
  // longest time between a request and its reply among the late replies; 0: no reply was late
  Time lateness{};
  std::uint64_t overfull = 0;  // number of good replies after which further bytes arrived that no request explains
  std::vector<std::uint8_t> overfull_example{};
  std::size_t most_behind = 0;  // greatest number of further bytes that followed a good reply
  std::vector<Trial> trials{};
  std::vector<ClockTrial> clocks{};   // readings with other clock rates, the slowest first; empty: none were tried
  std::optional<bool> data_driven{};  // whether something drives the data pin of the port; nothing: not known
  host::EchoMode echo_said{};         // whether the adapter echoes requests, as the user has set it
  host::EchoMode echo{};          // whether the adapter echoes requests, as the user has set it or as it was detected
  std::optional<Time> latency{};  // latency of the connection, as the user has set it
  Time computer_late{};           // greatest delay of this computer during the readings (os::DelayWatch)
  host::SpeedLimit limit{};       // highest speed that is assumed for the encoder's shaft
  std::string clash{};            // address at which two encoders seem to reply, "address 3"; "": none
  bool complete = true;
};

/// Returns how many of the given readings are good.
[[nodiscard]] inline std::size_t count_good(const std::vector<Attempted>& attempts) {
  return static_cast<std::size_t>(
      std::ranges::count_if(attempts, [](const Attempted& one) { return one.error == Error::none; }));
}

/// Returns whether at most one in 20 readings is good; so few good readings may be due to chance.
[[nodiscard]] inline bool hardly_any_good(const std::vector<Attempted>& attempts) {
  return count_good(attempts) * 20 < attempts.size() + 1;
}

/// Judges the observations and returns the result, with findings in the order of their kinds.
[[nodiscard]] Examination judge(const Unit& unit, const Options& options, const Observations& seen);

/// Returns the most likely finding for a single failed reading.
[[nodiscard]] Finding finding_of(const Unit& unit, const Options& options, PortKind place, const Attempted& last,
                                 bool usually_good, bool late);

}  // namespace absenc::client
