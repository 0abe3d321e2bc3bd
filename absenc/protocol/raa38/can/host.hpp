// SPDX-License-Identifier: Apache-2.0
// Host procedures of the RAA38S6 on CAN and their results; README.md, section CAN, gives the reasons.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/protocol/author/can_dialog.hpp"
#include "absenc/protocol/raa38/can/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::can {

using namespace std::chrono_literals;

// The document gives no reply times; the timeouts below are assumed to be longer than any node needs.
inline constexpr Time answer_limit = 50ms;  ///< Timeout of a reply on a bus without other frames.
inline constexpr Time busy_limit = 250ms;   ///< Timeout of a reply on a bus that other nodes keep busy.
/// Time for which the host listens for unsolicited frames.
inline constexpr Time listening_time = 1200ms;

/// Types and functions of the protocol that the classes in absenc/protocol/author use.
struct Protocol {
  /// Type of what the line transmits: CAN frames.
  using Item = CanFrame;
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = can::Format;
  /// Type of requests to the encoder.
  using Request = CanFrame;
  /// Type of the encoder's replies.
  using Reply = CanFrame;

  /// Returns how a host sends a frame; all frames are sent in the same manner.
  static constexpr author::Manner manner(const Format&, const CanFrame&) { return {}; }
  /// Returns the timeouts of a reply on a quiet and on a busy bus.
  static constexpr author::CanHostTimes host_times(const Format&) { return {answer_limit, busy_limit}; }
  /// Returns a frame with an 11-bit identifier as text: identifier and data in hexadecimal, such as
  /// "220:8020000000000000".
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

/// Returns cause and advice for the error of `reply`; if it is empty, for a missing reply or an invalid request. Either
/// text may be empty.
[[nodiscard]] Explanation explain(const Format& format, Error error, std::span<const CanFrame> request,
                                  std::span<const CanFrame> reply);

/// Reads one position: requests it (order 80 or 01), or waits for the next one that the node sends without a request.
class Read : public author::CanEngine {
 public:
  /// How the position is obtained: read request, start request, or listening.
  enum class Mode : std::uint8_t { ask, start, listen };
  /// Creates a conversation that reads one position in this mode.
  Read(const Format& format, Mode mode);

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns the position that was read; its `singleturn_bits` is 0 as long as none was read.
  [[nodiscard]] const Reading& found() const { return reading_; }
  [[nodiscard]] const Reading* reading() const final {
    // `singleturn_bits` is 0 until a valid position was received.
    return reading_.singleturn_bits != 0 ? &reading_ : nullptr;
  }

 private:
  void heard(const CanFrame& frame, Time at) final;
  void over() final;

  Format format_;
  Reading reading_{};
};

/// Returns the frame that requests a position: order 01 in the mode `start`, otherwise order 80.
[[nodiscard]] constexpr CanFrame position_request(const Format& format, Read::Mode mode) {
  // `encode` is called twice with a constant order, so that firmware does not link the table of orders.
  return mode == Read::Mode::start ? encode(Order::start, format.node) : encode(Order::read, format.node);
}

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

// ---- One node

/// Sets with order 31 the number of positions per second that the node sends, 0 for none, and measures the rate of the
/// frames that are received. Errors: timeout (of a number above 0: neither an answer nor a frame arrives), bad_framing
/// (as timeout, and frames are destroyed), cross_check_failed (another rate).
author::Procedure set_cyclic(Dialog& dialog, Values& found, Arguments arguments);

/// Changes the zero or the direction; cyclic positions of the node are stopped meanwhile. Order 20 makes the present
/// position 0, as the document suggests; it is not sent if the position is near 0 already. Order 22 sets the counting
/// direction, which no command reads; the position afterwards must be unchanged or mirrored. Errors besides those of
/// reading the position: not_still (the shaft turns), cross_check_failed (any other position, or the node no longer
/// sends cyclic positions), timeout (order 22 has neither an answer nor an effect).
author::Procedure change(Dialog& dialog, Values& found, Order order, Arguments arguments);

/// Requests a position of the node, and reports the node's number if a frame from it is received. Requests no other
/// number: on a CANopen bus such requests are process data of other devices. Errors: timeout, bad_framing (frames are
/// destroyed: two nodes may share the number).
author::Procedure find_node(Dialog& dialog, Values& found);

// ---- All nodes on the bus

/// Result of a scan for one node number.
struct NodeFrames {
  std::uint16_t unsolicited = 0;  ///< Number of frames that count as sent without a request.
  std::uint16_t per_second = 0;   ///< Those of `unsolicited` within one second after the first frame of any node.
  std::uint8_t answers = 0;       ///< Number of frames that count as answers, at most 255.
  std::uint8_t damaged = 0;       ///< Number of requests during which frames were destroyed.
  bool readable = false;          ///< Whether the last frame is a position that fits the format.
  std::uint32_t counts = 0;       ///< Position in the last frame, in counts; 0 if it is not `readable`.

  /// Returns whether the number is in use: a frame from it was received, or frames were destroyed at two requests.
  [[nodiscard]] constexpr bool is_there() const { return unsolicited != 0 || answers != 0 || damaged > 1; }
  /// Returns whether two nodes seem to share the number: more than one answer, or destroyed frames at two requests and
  /// no answer; and in both cases no frame without a request.
  [[nodiscard]] constexpr bool clash() const {
    return (unsolicited == 0 && answers > 1) || (damaged > 1 && answers == 0 && unsolicited == 0);
  }
};

/// Result of a scan: what was received from each node number.
struct Nodes {
  std::array<NodeFrames, 256> at{};  ///< Result of each node number, which is the index; 0 is unused.

  /// Returns how many node numbers were found on the bus.
  [[nodiscard]] unsigned count() const;
};

/// Finds the nodes on the bus. Listens first, because nodes may send without a request after power on, then requests
/// every number from 1 to 255. Errors: timeout (no node is found), bad_framing (frames are destroyed at both requests
/// for more than 16 numbers: wrong bit rate).
author::Procedure scan(Dialog& dialog, Nodes& nodes);

/// Result of `configure`: the setting, and the nodes that were found on the bus before it.
struct ConfigureResult : Values {
  Nodes nodes{};          ///< Nodes that were found on the bus.
  bool verified = false;  ///< Whether the written setting was verified.
};

/// Changes the node number (order 11) or the bit rate (order 13). The node must answer under the new number and, if it
/// is another, no longer under the old one; for the bit rate the host switches too, and back if the node does not
/// answer. Both orders are sent on 7E5, which reaches every node, so only one node may be on the bus. Errors:
/// invalid_argument (other nodes are on the bus, two nodes share the number, or the document does not have that rate),
/// unexpected_reply (only other nodes are on the bus), timeout, bad_framing, request_rejected, cross_check_failed (the
/// node answers under its old number or at its old rate).
author::Procedure configure(Dialog& dialog, ConfigureResult& found, Order order, Arguments arguments);

}  // namespace absenc::raa38::can
