// SPDX-License-Identifier: Apache-2.0
// What a host does with RAA38S6 nodes on CAN that has several steps; README.md, section CAN, says why.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/protocol/raa38/can/protocol.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::can {

using Bus = author::LineOf<Protocol>;

// ---- One node

/// 31: so many readings a second, 0: none. Whether that came true is heard. Error: cross_check_failed.
struct Cyclic {
  std::uint8_t readings_per_s = 0;
  bool answered = false;
};
author::Procedure set_cyclic(Bus& bus, Cyclic& found, Arguments arguments);

/// What a command made of the position.
struct Changed {
  std::uint8_t value = 0;
  bool written = false;
  bool answered = false;
  bool mirrored = false;
  std::uint32_t before = 0;
  std::uint32_t after = 0;
};

/// 20: the position is 0 here, as the document lets one guess: read before and after. Nothing is written when it is 0
/// already. Errors: invalid_argument (the shaft turns), cross_check_failed (it is not near 0 afterwards).
author::Procedure set_zero(Bus& bus, Changed& found);

/// 22: the counting direction, which no command reads. The position then is either the same or mirrored.
/// Errors: invalid_argument (the shaft turns), cross_check_failed (any other position), timeout (neither answer nor
/// effect).
author::Procedure set_direction(Bus& bus, Changed& found, Arguments arguments);

// ---- Every node of the bus

/// What was heard of one number.
struct Heard {
  std::uint16_t unasked = 0;     // frames that it sent by itself
  std::uint16_t per_second = 0;  // those of the first second
  std::uint8_t answers = 0;      // to one request
  std::uint8_t damaged = 0;      // requests at which frames were destroyed
  bool readable = false;         // `counts` fits the format
  std::uint32_t counts = 0;      // of the last frame

  [[nodiscard]] constexpr bool is_there() const { return unasked != 0 || answers != 0 || damaged > 1; }
  /// Two answers to one request, or destroyed frames each time.
  [[nodiscard]] constexpr bool clash() const {
    return (unasked == 0 && answers > 1) || (damaged > 1 && answers == 0 && unasked == 0);
  }
};

struct Nodes {
  std::array<Heard, 256> at{};

  /// How many numbers somebody has.
  [[nodiscard]] unsigned count() const;
  /// The first number that somebody has; 0: none.
  [[nodiscard]] std::uint8_t first() const;
};

/// Listens, because after power on nodes send unasked, then asks every number. Error: timeout when nobody is there.
author::Procedure scan(Bus& bus, Nodes& nodes);

/// The number of the node: of the only one, or of the one that is meant. Errors: timeout, unexpected_reply (only others
/// are there).
struct OneNode {
  Nodes nodes{};
  std::uint8_t node = 0;
};
author::Procedure find_node(Bus& bus, OneNode& found);

// ---- The configuration on 7E5, which reaches every node: only with one on the bus

/// Errors: invalid_argument (others are there, whom it would reach too), timeout, request_rejected, cross_check_failed
/// (the encoder did not do it).
struct Configured {
  Nodes nodes{};
  std::int64_t value = 0;  // as the argument gave it
  bool written = false;
  bool answered = false;
  bool verified = false;
};

/// 11: another number. It must answer under the new one and no longer under the old one.
author::Procedure set_node(Bus& bus, Configured& found, Arguments arguments);

/// 13: another bit rate, to which this end of the line goes too; back when the node is not there. Error besides:
/// invalid_argument for a rate that the document does not have.
author::Procedure set_rate(Bus& bus, Configured& found, Arguments arguments);

}  // namespace absenc::raa38::can
