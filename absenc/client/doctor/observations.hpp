// SPDX-License-Identifier: Apache-2.0
// What was seen of an encoder and its way, before anybody judges it.
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

/// A setting that was tried in place of that of the user.
struct Trial {
  Ailment ailment{};      // what it is when this one helps
  std::string said{};     // "baud=115200"
  std::string setting{};  // "baud=9600"
  std::size_t good = 0;
  std::size_t tried = 0;
  std::size_t good_as_said = 0;  // meanwhile, with the setting of the user
  std::size_t tried_as_said = 0;
  std::string command{};  // other_protocol: the address to read it by
};

/// Why the port did not open, or went away.
struct Refusal {
  os::Failure::Kind kind{};
  std::string sentence{};
  os::Failure::Bus bus = os::Failure::Bus::unknown;
  os::Failure::Holder holder = os::Failure::Holder::unknown;
};

struct Observations {
  PortKind place = PortKind::serial;
  std::string port{};  // its path, where it is a serial one
  os::PortFacts facts{};
  std::optional<os::LineCounts> damage{};  // that the UART counted meanwhile
  std::optional<Refusal> refusal{};
  std::vector<std::uint8_t> unsolicited{};  // before anything was sent
  Time listened{};
  bool never_silent = false;      // meanwhile
  std::size_t within_frames = 0;  // of an encoder that sends by itself: so many bytes are good frames, the others not
  std::vector<Attempted> readings{};
  /// Each request with its reply, where a reading took several; the frames, where the encoder sends by itself, and
  /// those that did not come in time. Empty: `readings` are all.
  std::vector<Attempted> exchanges{};
  std::vector<Attempted> turned{};  // while somebody turned the shaft by hand
  std::uint64_t line_errors = 0;    // of a CAN bus
  std::uint64_t late = 0;           // replies that came after their limit
  Time lateness{};                  // of the latest
  std::uint64_t overfull = 0;       // good replies behind which more came
  std::vector<std::uint8_t> overfull_example{};
  std::size_t most_behind = 0;  // items behind one of them
  std::vector<Trial> trials{};
  host::EchoMode echo_said{};     // by the user
  host::EchoMode echo{};          // as it was found
  std::optional<Time> latency{};  // as the user said
  Time woken_late{};              // how late this computer woke who waited meanwhile, at most
  host::SpeedLimit limit{};       // how fast it may move
  std::string clash{};            // "address 3": whatever answers there is damaged every time
  bool complete = true;
};

/// What is wrong, in the order of `Ailment`.
[[nodiscard]] Examination judge(const Unit& unit, const Options& options, const Observations& seen);

/// Of one reading that failed, at once: what is most likely behind it. `usually_good`: others mostly do not fail;
/// `late`: replies came after their limit. Its evidence may be incomplete.
[[nodiscard]] Finding finding_of(const Unit& unit, const Options& options, PortKind place, const Attempted& last,
                                 bool usually_good, bool late);

}  // namespace absenc::client
