// SPDX-License-Identifier: Apache-2.0
// What the ports of this folder throw.
#pragma once

#include <cstdint>
#include <exception>
#include <stdexcept>
#include <string>
#include <system_error>

namespace absenc::os {

/// Trouble with a port. `what()` says what happened and what to try, for people.
class Failure : public std::runtime_error {
 public:
  enum class Kind : std::uint8_t {
    not_found,      // no such port, host or listener
    no_permission,  // it is there, but not for this user
    in_use,         // another program has it
    unsupported,    // this port cannot do what was asked
    bad_rate,       // this port cannot do that baud rate
    lost,           // it was there and went away
    system,         // anything else that the operating system refused
  };

  /// What of a CAN bus is behind it, where that is known.
  enum class Bus : std::uint8_t { unknown, off, not_acknowledged };

  /// Who has a port that is in use.
  enum class Holder : std::uint8_t { unknown, program, absenc, server, modem_manager };

  Failure(Kind kind, const std::string& sentence, Bus bus = Bus::unknown)
      : std::runtime_error(sentence), kind_(kind), bus_(bus) {}
  /// A port that is in use.
  Failure(const std::string& sentence, Holder holder)
      : std::runtime_error(sentence), kind_(Kind::in_use), holder_(holder) {}
  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] Bus bus() const { return bus_; }
  [[nodiscard]] Holder holder() const { return holder_; }

 private:
  Kind kind_;
  Bus bus_ = Bus::unknown;
  Holder holder_ = Holder::unknown;
};

/// "<what> failed: <text of error>"; `error` is a value of errno.
[[nodiscard]] inline Failure system_failure(const std::string& what, int error) {
  return {Failure::Kind::system, what + " failed: " + std::generic_category().message(error)};
}

// Both are std::exceptions, so that a program whose `main` catches those ends in order. Code that catches all
// std::exceptions and goes on catches these two first.

/// Thrown out of every wait of this folder after SIGINT or SIGTERM (os/signals.hpp).
struct Interrupted : std::exception {
  [[nodiscard]] const char* what() const noexcept override { return "interrupted"; }
};

/// Thrown by a port when the time given to `StreamPort::set_end` has come, and out of every wait when an EndQuestion
/// says so.
struct Ended : std::exception {
  [[nodiscard]] const char* what() const noexcept override { return "cancelled"; }
};

}  // namespace absenc::os
