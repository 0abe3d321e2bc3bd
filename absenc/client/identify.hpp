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

/// An encoder that explains the received frames, and the evidence for it.
struct FoundEncoder {
  const Unit* unit = nullptr;           ///< Unit whose protocol explains the replies.
  Options options{};                    ///< Options of the unit with which the replies are explained.
  std::vector<std::string> settings{};  ///< Short list of settings that yields `options`, as "model=23-bit".
  /// Address for `open`, as "tformat:/dev/ttyUSB0?model=23-bit"; "" for a capture.
  std::string address{};
  /// Setting with the address of this encoder, as "address=3"; may be "".
  std::string encoder{};
  std::string line{};         ///< Line of the encoder, as "RS-485 half duplex, 2.5 Mbit/s".
  std::size_t tried = 0;      ///< Number of exchanges that were checked.
  std::size_t explained = 0;  ///< Number of the checked exchanges that the encoder explains.
  double log10_chance = 0;    ///< Decimal logarithm of the probability that chance gives so good an explanation.
  bool sure = false;          ///< Whether `log10_chance` is small enough to exclude chance.
  Answer identity{};          ///< Identity that the encoder on a line reports, such as its serial number.
};

/// Result of `identify` and `identify_capture`: the encoders that explain the received or captured frames.
struct Identified {
  std::vector<FoundEncoder> found{};  ///< Encoders, the most probable first.
  /// Sentences about protocols that could not be tried, damaged data, identities that could not be read, and identities
  /// that contradict the options.
  std::vector<std::string> notes{};
  bool is_complete = true;  ///< False if the time limit ended the search early.
};

/// Time limit and callback of `identify`.
struct IdentifyChoices {
  Time limit = std::chrono::seconds(60);  ///< Time limit of the whole search.
  /// Called with a description of each step before it is tried.
  std::function<void(const std::string& what)> progress{};
};

/// Polls the line with the protocols that fit and returns the encoders that it finds. `place` is a port with its
/// settings, as "/dev/ttyUSB0" or "tcp:HOST:PORT?latency=50". Throws os::Failure, UsageError, os::Interrupted.
[[nodiscard]] Identified identify(std::string_view place, const IdentifyChoices& choices = {});

/// Returns the encoders that explain the frames of the capture `path`. `choices` must contain neither a model nor
/// options. Throws UsageError, os::Interrupted.
[[nodiscard]] Identified identify_capture(const std::string& path, const DecodeChoices& choices = {});

}  // namespace absenc::client
