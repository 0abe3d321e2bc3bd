// SPDX-License-Identifier: Apache-2.0
// Exceptions that the functions and classes of this folder throw.
#pragma once

#include <cstdint>
#include <exception>
#include <stdexcept>
#include <string>
#include <system_error>

namespace absenc::os {

/// A failure of a port, a file or another object of the operating system. `what()` is a text for the user.
class Failure : public std::runtime_error {
 public:
  /// Kind of a failure.
  enum class Kind : std::uint8_t {
    not_found,      ///< the port, host, listener, file, folder or GPIO line does not exist or cannot be reached
    no_permission,  ///< this user may not open or create the port or file
    in_use,         ///< another program uses the port or file, or a new file would replace another
    unsupported,    ///< the port, file or kernel cannot do what was requested, or a name is invalid
    bad_rate,       ///< this port does not support the requested baud rate
    lost,           ///< the port, connection or file has disappeared or works no more, or the file was cut
    system,         ///< any other error of the operating system
  };

  /// State of the CAN bus that caused a failure: `off` (bus-off, after too many errors), `not_acknowledged` (no node
  /// acknowledged a frame), or `unknown`.
  enum class Bus : std::uint8_t { unknown, off, not_acknowledged };

  /// Kind of program that uses a port, so that this program cannot open it.
  enum class Holder : std::uint8_t { unknown, program, absenc, server, modem_manager };

  /// Makes a failure with `sentence` as its text. `bus`: state of the CAN bus, if that caused the failure.
  Failure(Kind kind, const std::string& sentence, Bus bus = Bus::unknown)
      : std::runtime_error(sentence), kind_(kind), bus_(bus) {}
  /// Makes a failure of kind `in_use`, with the kind of program that holds the port.
  Failure(const std::string& sentence, Holder holder)
      : std::runtime_error(sentence), kind_(Kind::in_use), holder_(holder) {}
  /// Returns the kind of the failure.
  [[nodiscard]] Kind kind() const { return kind_; }
  /// Returns the state of the CAN bus that caused the failure; `unknown` if no such state did.
  [[nodiscard]] Bus bus() const { return bus_; }
  /// Returns the kind of program that holds the port; `unknown` if that is not known.
  [[nodiscard]] Holder holder() const { return holder_; }

 private:
  Kind kind_;
  Bus bus_ = Bus::unknown;
  Holder holder_ = Holder::unknown;
};

/// Returns a Failure "<what> failed: <text of error>"; `error` is a value of errno.
[[nodiscard]] inline Failure system_failure(const std::string& what, int error) {
  return {Failure::Kind::system, what + " failed: " + std::generic_category().message(error)};
}

// Code that catches std::exception and continues must catch Interrupted and Ended first.

/// Thrown after SIGINT or SIGTERM, once `catch_interrupts` (os/signals.hpp) was called.
struct Interrupted : std::exception {
  /// Returns the text "interrupted".
  [[nodiscard]] const char* what() const noexcept override { return "interrupted"; }
};

/// Thrown by a port at the time of its `set_end`, and by waits when a CancelCheck returns true.
struct Ended : std::exception {
  /// Returns the text "cancelled".
  [[nodiscard]] const char* what() const noexcept override { return "cancelled"; }
};

}  // namespace absenc::os
