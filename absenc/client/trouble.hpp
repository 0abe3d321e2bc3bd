// SPDX-License-Identifier: Apache-2.0
// Description of a failed command or reading, in words and with the bytes on the line.
#pragma once

#include <string>
#include <utility>

#include "absenc/client/change.hpp"
#include "absenc/client/error.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"

namespace absenc::client {

/// A failed command or reading in words. Every text may be empty.
struct Trouble {
  Error error = Error::none;  ///< Kind of the error.
  std::string message{};      ///< Sentence that says what happened and, if possible, what the received bytes are.
  std::string exchange{};     ///< Request and reply, as text for people.
  std::string advice{};       ///< What the user can try; "": no advice.
  std::string sent{};         ///< Bytes or frames that were sent, as text.
  std::string received{};     ///< Bytes or frames that were received, as text; "": none were received.
  Change change{};            ///< State of the change if the command changes the encoder; otherwise `none`.
  /// Finding of client/doctor.hpp that the failed reading suggests, "only_echo: ..."; "": none.
  std::string finding{};

  /// Returns error, message, exchange, advice and change as text of several lines.
  [[nodiscard]] std::string text() const;
};

/// A failed exchange that was stored for later inspection.
struct BadExchangeText {
  Error error = Error::none;  ///< Kind of the error.
  Time at{};                  ///< Time of the exchange, by the same clock as the times of readings.
  std::string sent{};         ///< The first bytes or frames of the exchange that were sent, as text.
  std::string received{};     ///< First bytes or frames that were received, as text; "": none were received.
};

/// Exception for a failed command or reading.
struct EncoderFailure : Failure {
  /// Makes an exception whose text is that of `what_failed`.
  explicit EncoderFailure(Trouble what_failed) : Failure(what_failed.text()), trouble(std::move(what_failed)) {}
  Trouble trouble;  ///< Description of the failure, with the evidence.
};

}  // namespace absenc::client
