// SPDX-License-Identifier: Apache-2.0
// Identifies the encoder on a line or the one whose frames are in a capture.
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

/// An encoder that explains the received frames.
struct FoundEncoder {
  const Unit* unit = nullptr;           ///< The unit that explains the replies.
  Options options{};                    ///< Options with which it does.
  std::vector<std::string> settings{};  ///< Shortest list of settings that yields these options, as "model=23-bit".
  /// Address for `open`, as "tformat:/dev/ttyUSB0?model=23-bit"; "" for a capture.
  std::string address{};
  /// Selects one of several encoders on the line, as "address=3"; "": the only one.
  std::string encoder{};
  std::string line{};         ///< Line of the encoder, as "RS-485 half duplex, 2.5 Mbit/s".
  std::size_t tried = 0;      ///< Number of exchanges that were checked.
  std::size_t explained = 0;  ///< Number of exchanges that the encoder explains.
  double log10_chance = 0;    ///< Decimal logarithm of the probability that noise explains as many.
  bool sure = false;          ///< Whether this probability is small enough to be sure.
  Answer identity{};          ///< Identity that the encoder on a line reports, such as its serial number.
};

/// Result of `identify`: the units that explain what the port received.
struct Identified {
  std::vector<FoundEncoder> found{};  ///< Encoders, the most probable first.
  std::vector<std::string> notes{};   ///< Sentences about attempts that were impossible and about damaged data.
  bool is_complete = true;            ///< False if the time limit ended the search early.
};

/// Limits of `identify`: the requests it may send, and how long it listens.
struct IdentifyChoices {
  Time limit = std::chrono::seconds(60);                    ///< Time limit of the whole search.
  std::function<void(const std::string& what)> progress{};  ///< Called with the step that is tried next.
};

/// Polls the line with every protocol that fits, at its rates and addresses, with reads that change nothing. `place` is
/// a port with its settings: "/dev/ttyUSB0", "tcp:HOST:PORT?latency=50", "spi:/dev/spidev0.0", "can0". Throws
/// os::Failure, UsageError, os::Interrupted.
[[nodiscard]] Identified identify(std::string_view place, const IdentifyChoices& choices = {});

/// Identifies the encoder in a capture. The model and options of `choices` limit the search. Throws UsageError,
/// Failure.
[[nodiscard]] Identified identify_capture(const std::string& path, const DecodeChoices& choices = {});

}  // namespace absenc::client
