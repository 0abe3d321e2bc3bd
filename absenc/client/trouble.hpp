// SPDX-License-Identifier: Apache-2.0
// Description of a failed command, in words and with the bytes on the line.
#pragma once

#include <string>
#include <utility>

#include "absenc/client/change.hpp"
#include "absenc/client/error.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"

namespace absenc::client {

/// A failed command in words. Every text may be empty.
struct Trouble {
  Error error = Error::none;  ///< Why the conversation failed.
  std::string message{};      ///< What happened, and how the reply was identified.
  std::string exchange{};     ///< Request and reply with their times.
  std::string advice{};       ///< What the user can try.
  std::string sent{};         ///< The sent bytes, as the link's wire text.
  std::string received{};     ///< The received bytes in hexadecimal; empty: none.
  Change change{};            ///< State of the change; only of a command that changes the encoder.
  /// Finding of client/doctor.hpp that a failed reading looks like, "only_echo: ..."; "": none.
  std::string finding{};

  /// Returns the texts without the finding and without a last line end. May have several lines.
  [[nodiscard]] std::string text() const;
};

/// A stored bad exchange.
struct BadExchangeText {
  Error error = Error::none;  ///< Why the exchange failed.
  Time at{};                  ///< Time of the exchange, on the clock of the readings.
  std::string sent{};         ///< The sent bytes, as the link's wire text.
  std::string received{};     ///< The received bytes in hexadecimal; empty: none.
};

/// A command that failed, or a reading that failed.
struct EncoderFailure : Failure {
  /// Makes an exception with the text of `what_failed`.
  explicit EncoderFailure(Trouble what_failed) : Failure(what_failed.text()), trouble(std::move(what_failed)) {}
  Trouble trouble;  ///< What failed, with the evidence.
};

}  // namespace absenc::client
