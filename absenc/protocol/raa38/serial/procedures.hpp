// SPDX-License-Identifier: Apache-2.0
// What a host does with an RAA38S6 on an asynchronous line that has several steps. Endless reading of a stream:
// listen.hpp.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/protocol/raa38/serial/protocol.hpp"

namespace absenc::raa38::serial {

using HostLine = author::LineOf<Protocol>;

/// Reads, sets the zero, and reads until the position is zero. The shaft must stand still. Errors: unsupported and
/// invalid_argument when the settings have no way to do it, or it turns; cross_check_failed when it is not zero after
/// half a second.
struct Zeroed {
  Position before{};
  Position now{};
};
author::Procedure set_zero(HostLine& line, Zeroed& found);

/// Listens whether somebody transmits unasked, then asks every number of a bus, whatever the mode. An answer that is
/// damaged every time tells of two encoders with one number, or of a bad line. Errors: timeout when nobody answers,
/// unexpected_reply when somebody transmits unasked.
struct Units {
  struct One {
    bool answers = false;
    bool clash = false;
    Position position{};
  };
  std::array<One, unit_count> units{};
};
author::Procedure scan(HostLine& line, Units& found);

}  // namespace absenc::raa38::serial
