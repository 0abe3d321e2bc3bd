// SPDX-License-Identifier: Apache-2.0
// Why an encoder did not do what it was asked, in words and with what went over the line.
#pragma once

#include <string>
#include <utility>

#include "absenc/client/change.hpp"
#include "absenc/client/error.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"

namespace absenc::client {

/// A failed command in words. The texts but `error` may be empty.
struct Trouble {
  Error error = Error::none;  ///< Why the conversation failed.
  std::string message{};      ///< what happened, and what the reply turns out to be
  std::string exchange{};     ///< what was sent, what came back and when
  std::string advice{};       ///< what to try
  std::string sent{};         ///< hexadecimal or as the link's wire text
  std::string received{};     ///< The received bytes in hexadecimal; empty: none.
  Change change{};            ///< of a command that changes the encoder
  std::string finding{};      ///< of a reading: which of those of client/doctor.hpp it looks like, "only_echo: ..."

  /// Without the finding. Of several lines, without the last line end.
  [[nodiscard]] std::string text() const;
};

/// A bad exchange that was kept.
struct BadExchangeText {
  Error error = Error::none;  ///< Why the exchange failed.
  Time at{};                  ///< on the clock of the readings
  std::string sent{};         ///< as the link's wire text
  std::string received{};     ///< The received bytes in hexadecimal; empty: none.
};

/// A command that the encoder did not do, or a reading that failed.
struct EncoderFailure : Failure {
  /// Describes `what_failed` in its text.
  explicit EncoderFailure(Trouble what_failed) : Failure(what_failed.text()), trouble(std::move(what_failed)) {}
  Trouble trouble;  ///< What failed, with the evidence.
};

}  // namespace absenc::client
