// SPDX-License-Identifier: Apache-2.0
// The RAA38S6 on CAN, as a host talks to it; README.md, section CAN, says why.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/protocol/author/can_dialog.hpp"
#include "absenc/protocol/raa38/can/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::can {

using namespace std::chrono_literals;

// The document gives no times; these are far beyond what any controller needs.
inline constexpr Time answer_limit = 50ms;  // without any frame on the bus
inline constexpr Time busy_limit = 250ms;   // on a bus that others keep busy
inline constexpr Time listening_time = 1200ms;

struct Protocol {
  using Item = CanFrame;
  using Format = can::Format;
  using Request = CanFrame;
  using Reply = CanFrame;

  static constexpr author::Manner manner(const Format&, const CanFrame&) { return {}; }
  static constexpr author::CanHostTimes host_times(const Format&) { return {answer_limit, busy_limit}; }
  /// "220:8020000000000000"
  static constexpr ByteBuffer<4 + 2 * frame_size> encode(const Format&, const CanFrame& frame) {
    constexpr std::string_view digits = "0123456789abcdef";
    ByteBuffer<4 + 2 * frame_size> text;
    const auto put_digit = [&](unsigned value) { text.push_back(static_cast<std::uint8_t>(digits[value & 15])); };
    for (unsigned i = 0; i < 3; ++i) put_digit(frame.id >> (8 - 4 * i));
    text.push_back(':');
    for (const std::uint8_t byte : frame.bytes()) {
      put_digit(byte >> 4u);
      put_digit(byte);
    }
    return text;
  }
};

/// What a frame with such an error shows, and what to do. Either may be empty.
[[nodiscard]] Explanation explain(const Format& format, Error error, std::span<const CanFrame> request,
                                  std::span<const CanFrame> reply);

/// One position: asked for (80, 01), or the next that the node sends by itself.
class Read : public author::CanEngine {
 public:
  enum class Way : std::uint8_t { ask, start, listen };
  Read(const Format& format, Way way);

  [[nodiscard]] const Format& format() const { return format_; }
  [[nodiscard]] const Reading& found() const { return reading_; }
  [[nodiscard]] const Reading* reading() const final {
    return reading_.singleturn_bits != 0 ? &reading_ : nullptr;  // of a good end only
  }

 private:
  void heard(const CanFrame& frame, Time at) final;
  void over() final;

  Format format_;
  Reading reading_{};
};

/// The frame by which a node is asked for its position; of `listen`, what asks it once.
[[nodiscard]] constexpr CanFrame position_request(const Format& format, Read::Way way) {
  // Each on its own: the table of orders is not linked then.
  return way == Read::Way::start ? encode(Order::start, format.node) : encode(Order::read, format.node);
}

using Dialog = author::DialogOf<Protocol>;

// ---- One node

/// 31: so many readings a second, 0: none. Whether that came true is heard. Error: cross_check_failed.
author::Procedure set_cyclic(Dialog& dialog, Values& found, Arguments arguments);

/// 20: the position is 0 here, as the document lets one guess: read before and after. Nothing is written when it is 0
/// already. 22: the counting direction, which no command reads. The position then is either the same or mirrored.
/// Errors: invalid_argument (the shaft turns), cross_check_failed (any other position), timeout (neither answer nor
/// effect of 22).
author::Procedure change(Dialog& dialog, Values& found, Order order, Arguments arguments);

/// The number of the node, if it answers. No other is asked: on a CANopen bus the requests to them are process data of
/// other devices. Errors: timeout, bad_framing (frames are destroyed: two nodes may have the number).
author::Procedure look_for_node(Dialog& dialog, Values& found);

// ---- Every node of the bus

/// What was heard of one number.
struct Heard {
  std::uint16_t unsolicited = 0;  // frames that it sent by itself
  std::uint16_t per_second = 0;   // those of the first second
  std::uint8_t answers = 0;       // to one request
  std::uint8_t damaged = 0;       // requests at which frames were destroyed
  bool readable = false;          // `counts` fits the format
  std::uint32_t counts = 0;       // of the last frame

  [[nodiscard]] constexpr bool is_there() const { return unsolicited != 0 || answers != 0 || damaged > 1; }
  /// Two answers to one request, or destroyed frames each time.
  [[nodiscard]] constexpr bool clash() const {
    return (unsolicited == 0 && answers > 1) || (damaged > 1 && answers == 0 && unsolicited == 0);
  }
};

struct Nodes {
  std::array<Heard, 256> at{};

  /// How many numbers somebody has.
  [[nodiscard]] unsigned count() const;
};

/// Listens, because after power on nodes send unsolicited, then asks every number. Error: timeout when nobody is there.
author::Procedure scan(Dialog& dialog, Nodes& nodes);

struct Surveyed : Values {
  Nodes nodes{};
  bool verified = false;  // what was written
};

/// 11: another number; it must answer under the new one and no longer under the old one. 13: another bit rate, to which
/// this end of the line goes too; back when the node is not there. On 7E5, which reaches every node: only with one on
/// the bus. Errors: invalid_argument (others are there, or the document does not have that rate), timeout,
/// request_rejected, cross_check_failed (the encoder did not do it).
author::Procedure configure(Dialog& dialog, Surveyed& found, Order order, Arguments arguments);

}  // namespace absenc::raa38::can
