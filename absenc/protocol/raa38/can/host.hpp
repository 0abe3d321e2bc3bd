// SPDX-License-Identifier: Apache-2.0
// Host procedures of the RAA38S6 on CAN; README.md, section CAN, gives the reasons.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/protocol/author/can_dialog.hpp"
#include "absenc/protocol/raa38/can/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::can {

using namespace std::chrono_literals;

// The document gives no times; these are far longer than any controller needs.
inline constexpr Time answer_limit = 50ms;      ///< timeout of a reply on a bus without other frames
inline constexpr Time busy_limit = 250ms;       ///< timeout of a reply on a bus that others keep busy
inline constexpr Time listening_time = 1200ms;  ///< Time for which a survey listens.

/// The protocol, as author layers use it: frames, lengths and times.
struct Protocol {
  /// The line carries CAN frames.
  using Item = CanFrame;
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = can::Format;
  /// Type of requests to the encoder.
  using Request = CanFrame;
  /// Type of the encoder's replies.
  using Reply = CanFrame;

  /// Returns how a host sends a request (repetitions, pauses) and how the reply to it ends.
  static constexpr author::Manner manner(const Format&, const CanFrame&) { return {}; }
  /// Returns how long a host waits for replies.
  static constexpr author::CanHostTimes host_times(const Format&) { return {answer_limit, busy_limit}; }
  /// Returns the frame as text, as "220:8020000000000000".
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

/// Explains the error of a frame. `request` or `reply` may be empty.
[[nodiscard]] Explanation explain(const Format& format, Error error, std::span<const CanFrame> request,
                                  std::span<const CanFrame> reply);

/// Reads one position: requested (orders 80 and 01), or the next that the node sends without a request.
class Read : public author::CanEngine {
 public:
  /// How the position is obtained: read request, start request, or listening.
  enum class Mode : std::uint8_t { ask, start, listen };
  /// Reads one position in this mode.
  Read(const Format& format, Mode mode);

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns the last position.
  [[nodiscard]] const Reading& found() const { return reading_; }
  [[nodiscard]] const Reading* reading() const final {
    return reading_.singleturn_bits != 0 ? &reading_ : nullptr;  // set only after a successful end
  }

 private:
  void heard(const CanFrame& frame, Time at) final;
  void over() final;

  Format format_;
  Reading reading_{};
};

/// Returns the frame that requests a position; for `listen`, the single read request.
[[nodiscard]] constexpr CanFrame position_request(const Format& format, Read::Mode mode) {
  // Two calls with constant orders, so that the table of orders is not linked.
  return mode == Read::Mode::start ? encode(Order::start, format.node) : encode(Order::read, format.node);
}

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

// ---- One node

/// Order 31: sets the number of positions per second that the node sends, 0 for none, and counts the received ones.
/// Error: cross_check_failed (another number arrives).
author::Procedure set_cyclic(Dialog& dialog, Values& found, Arguments arguments);

/// Changes the zero or the direction. Order 20 makes the present position 0, as the document suggests; the position is
/// read before and after, and nothing is written if it is 0 already. Order 22 sets the counting direction, which no
/// command reads; the position afterwards must be the same or mirrored. Errors: not_still (the shaft turns),
/// cross_check_failed (any other position), timeout (order 22 has neither an answer nor an effect).
author::Procedure change(Dialog& dialog, Values& found, Order order, Arguments arguments);

/// Reports the number of the node if it answers. No other number is requested: on a CANopen bus such requests are
/// process data of other devices. Errors: timeout, bad_framing (frames are destroyed: two nodes may share the number).
author::Procedure find_node(Dialog& dialog, Values& found);

// ---- All nodes on the bus

/// Frames received from one node number.
struct NodeFrames {
  std::uint16_t unsolicited = 0;  ///< frames sent without a request
  std::uint16_t per_second = 0;   ///< frames without a request in the first second
  std::uint8_t answers = 0;       ///< answers to one request
  std::uint8_t damaged = 0;       ///< requests during which frames were destroyed
  bool readable = false;          ///< `counts` fits the format
  std::uint32_t counts = 0;       ///< position in the last frame

  /// Returns whether a node with this number was found.
  [[nodiscard]] constexpr bool is_there() const { return unsolicited != 0 || answers != 0 || damaged > 1; }
  /// Returns whether two nodes seem to share the number: two answers to one request, or destroyed frames each time.
  [[nodiscard]] constexpr bool clash() const {
    return (unsolicited == 0 && answers > 1) || (damaged > 1 && answers == 0 && unsolicited == 0);
  }
};

/// Nodes that were found, by number.
struct Nodes {
  std::array<NodeFrames, 256> at{};  ///< Frames of each node number.

  /// Returns how many node numbers are in use.
  [[nodiscard]] unsigned count() const;
};

/// Finds all nodes. Listens first, because nodes may send without a request after power on, then requests every number.
/// Error: timeout if no node is found.
author::Procedure scan(Dialog& dialog, Nodes& nodes);

/// Result of a setting, with the nodes that were found on the bus.
struct ConfigureResult : Values {
  Nodes nodes{};          ///< Nodes that were found, by number.
  bool verified = false;  ///< the written setting was verified
};

/// Order 11 sets the node number; the node must answer under the new number and no longer under the old one. Order 13
/// sets the bit rate; the host switches too, and back if the node does not answer. Both are sent on 7E5, which reaches
/// every node, so only one node may be on the bus. Errors: invalid_argument (other nodes are on the bus, or the
/// document does not have that rate), timeout, request_rejected, cross_check_failed (the node kept its old setting).
author::Procedure configure(Dialog& dialog, ConfigureResult& found, Order order, Arguments arguments);

}  // namespace absenc::raa38::can
