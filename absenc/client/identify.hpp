// SPDX-License-Identifier: Apache-2.0
// Which encoder is on a line, or whose frames are in a capture.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/decode.hpp"
#include "absenc/client/row.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// An encoder that explains what came.
struct Found {
  const Unit* unit = nullptr;           ///< The unit that explains the replies.
  Options options{};                    ///< Options with which it does.
  std::vector<std::string> settings{};  ///< the fewest that make these options: "model=23-bit"
  std::string address{};                ///< of a line: to open it by, "tformat:/dev/ttyUSB0?model=23-bit"
  std::string encoder{};                ///< "address=3": which of several on the line; "": the only one
  std::string line{};                   ///< "RS-485 half duplex, 2.5 Mbit/s"
  std::size_t tried = 0;                ///< exchanges that were looked at
  std::size_t explained = 0;            ///< of them
  double log10_chance = 0;              ///< of the probability that noise explains as many
  bool sure = false;                    ///< it is small enough
  Answer identity{};                    ///< of a line: what it says of itself, as its serial number
};

/// Result of `identify`: the units that explain what the port received.
struct Identified {
  std::vector<Found> found{};        ///< the likeliest first
  std::vector<std::string> notes{};  ///< sentences: what could not be tried, or is damaged
  bool is_complete = true;           ///< false: the time was over before all was tried
};

/// What `identify` may send, and how long it listens.
struct IdentifyChoices {
  Time limit = std::chrono::seconds(60);                    ///< of the whole search
  std::function<void(const std::string& what)> progress{};  ///< what is tried now
};

/// Asks in every protocol that fits, at its rates and addresses, by reads that change nothing. `place` is a port with
/// its settings: "/dev/ttyUSB0", "tcp:HOST:PORT?latency=50", "spi:/dev/spidev0.0", "can0". Throws os::Failure,
/// UsageError, os::Interrupted.
[[nodiscard]] Identified identify(std::string_view place, const IdentifyChoices& choices = {});

/// The model and the options of `choices` are what is looked for. Throws UsageError, Failure.
[[nodiscard]] Identified identify_capture(const std::string& path, const DecodeChoices& choices = {});

}  // namespace absenc::client
