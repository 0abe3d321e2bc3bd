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
  FindingKind finding_kind{};  // kind of the finding that is reported if the other setting helps
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
  std::uint32_t rate = 0;  // Hz
  std::size_t good = 0;    // readings without an error and, if the shaft rested, with the position of those before
  std::size_t tried = 0;
  bool is_set = false;  // whether this is the clock that the user has set
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
  // errors that the UART counted during the examination; nothing: not known
  std::optional<os::LineCounts> damage{};
  std::optional<Refusal> refusal{};
  std::vector<std::uint8_t> unsolicited{};  // bytes received before the first request, about the first 4096
  Time listened{};
  // whether bytes were received in at least 4 of the 5 periods of listening before the first request
  bool never_silent = false;
  std::vector<Attempted> readings{};
  // Failed requests that the host repeated within a reading.
  std::vector<Attempted> repeated{};
  std::vector<Attempted> damaged_frames{};  // damaged frames of a stream, cut at the pauses between frames
  std::size_t doubled = 0;                  // number of frames of a stream that arrived twice; 0 also if these are few
  bool is_stream = false;                   // whether the encoder sends frames without requests
  std::vector<Attempted> turned{};          // readings during which the user was to turn the shaft by hand
  std::uint64_t line_errors = 0;            // number of line errors that the port reported; on CAN, of error frames
  std::uint64_t late = 0;      // number of replies that began after their timeout or answered an older request
  Time lateness{};             // greatest time from a request to its late reply; 0: no reply was late
  std::uint64_t overfull = 0;  // number of good replies with further bytes after them that no request explains
  std::vector<std::uint8_t> overfull_example{};
  std::size_t most_behind = 0;  // greatest number of further bytes after a good reply
  std::vector<Trial> trials{};
  std::vector<ClockTrial> clocks{};   // readings with other clock rates, the slowest first; empty: none were tried
  std::optional<bool> data_driven{};  // whether something drives the data pin of the port; nothing: not known
  host::EchoMode echo_said{};         // echo mode that the user set
  host::EchoMode echo{};              // echo mode at the end: that of the user, or detected
  std::optional<Time> latency{};      // latency that the user set
  Time computer_late{};               // greatest delay of this computer during the readings (os::DelayWatch)
  host::SpeedLimit limit{};           // speed limit of the encoder's shaft
  std::string clash{};                // address at which two encoders seem to reply, "address 3"; "": none
  bool complete = true;
};

/// Returns the number of good attempts.
[[nodiscard]] inline std::size_t count_good(const std::vector<Attempted>& attempts) {
  return static_cast<std::size_t>(
      std::ranges::count_if(attempts, [](const Attempted& one) { return one.error == Error::none; }));
}

/// Returns whether at most one in 20 attempts is good; so few good replies may be due to chance.
[[nodiscard]] inline bool hardly_any_good(const std::vector<Attempted>& attempts) {
  return count_good(attempts) * 20 < attempts.size() + 1;
}

/// Judges the observations and returns the result, with findings in the order of their kinds.
[[nodiscard]] Examination judge(const Unit& unit, const Options& options, const Observations& seen);

/// Returns the most likely finding for a single failed reading.
[[nodiscard]] Finding finding_of(const Unit& unit, const Options& options, PortKind place, const Attempted& last,
                                 bool usually_good, bool late);

}  // namespace absenc::client
