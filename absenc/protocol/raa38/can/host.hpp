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

// The document gives no reply times, so the next three times are assumed.
inline constexpr Time answer_limit = 50ms;  ///< Timeout of a reply on a bus without other frames.
inline constexpr Time busy_limit = 250ms;   ///< Timeout of a reply on a bus that other nodes keep busy.
/// Time for which the host listens for unsolicited frames whose rate it does not know.
inline constexpr Time listening_time = 1200ms;

/// Types and functions of the protocol that the classes in absenc/protocol/author use.
struct Protocol {
  /// Type of what the line transmits: CAN frames.
  using Item = CanFrame;
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = can::Format;
  /// C++ type of the requests to the encoder.
  using Request = CanFrame;
  /// C++ type of the encoder's replies.
  using Reply = CanFrame;

  /// Returns how a host sends a frame; all frames are sent in the same manner.
  static constexpr author::Manner manner(const Format&, const CanFrame&) { return {}; }
  /// Returns the timeouts of a reply on a quiet and on a busy bus.
  static constexpr author::CanHostTimes host_times(const Format&) { return {answer_limit, busy_limit}; }
  /// Returns a frame with an 11-bit identifier as hexadecimal text, such as "220:8020000000000000".
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

/// Returns cause and advice for an error; either text may be empty.
[[nodiscard]] Explanation explain(const Format& format, Error error, std::span<const CanFrame> request,
                                  std::span<const CanFrame> reply);

/// Reads one position: requests it, or waits for one that the node sends by itself.
class Read : public author::CanEngine {
 public:
  /// How the position is obtained: by the read request, by the start request, or by listening.
  enum class Mode : std::uint8_t { ask, start, listen };
  /// Creates a conversation that reads one position; `mode` selects how it obtains the position.
  Read(const Format& format, Mode mode);

  /// Returns the frame layout and settings of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns the position that was read; its `singleturn_bits` is 0 as long as none was read.
  [[nodiscard]] const Reading& found() const { return reading_; }
  [[nodiscard]] const Reading* reading() const final {
    // The member `singleturn_bits` is 0 until a valid position was received.
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
  // Each call of `encode` states its order as a constant, so that firmware does not link the table `orders`.
  return mode == Read::Mode::start ? encode(Order::start, format.node) : encode(Order::read, format.node);
}

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

// ---- One node

/// Sets with order 31 the number of positions per second that the node sends by itself; 0: none. Errors: timeout,
/// bad_framing, cross_check_failed.
author::Procedure set_cyclic(Dialog& dialog, Values& found, Arguments arguments);

/// Sets the zero (order 20, as the document suggests) or the counting direction (order 22). Errors: not_still,
/// cross_check_failed, timeout, or those of reading the position.
author::Procedure change(Dialog& dialog, Values& found, Order order, Arguments arguments);

/// Requests the position of the node and reports its number if a frame from it follows. Errors: timeout, bad_framing.
author::Procedure find_node(Dialog& dialog, Values& found);

// ---- All nodes on the bus

/// Result of a scan for one node number: the frames received from it.
struct NodeFrames {
  std::uint16_t unsolicited = 0;  ///< Number of the node's frames that count as sent without a request.
  /// Number of unsolicited frames of the node within one second after the first frame of any node.
  std::uint16_t per_second = 0;
  std::uint8_t answers = 0;  ///< Number of the node's frames that count as answers, at most 255.
  std::uint8_t damaged = 0;  ///< Number of requests to the node during which frames were destroyed.
  bool readable = false;     ///< Whether the node's last frame is a position that fits the format.
  std::uint32_t counts = 0;  ///< Position in the node's last frame, in counts; 0 if it is not `readable`.

  /// Returns whether a node seems to have this number.
  [[nodiscard]] constexpr bool is_there() const { return unsolicited != 0 || answers != 0 || damaged > 1; }
  /// Returns whether two nodes seem to share the number.
  [[nodiscard]] constexpr bool clash() const {
    return (unsolicited == 0 && answers > 1) || (damaged > 1 && answers == 0 && unsolicited == 0);
  }
};

/// Result of a scan: the frames that were received from each node number.
struct Nodes {
  std::array<NodeFrames, 256> at{};  ///< Frames of each node number, which is the index; 0 is unused.

  /// Returns how many node numbers were found on the bus.
  [[nodiscard]] unsigned count() const;
};

/// Finds the nodes on the bus by requesting every number from 1 to 255. Errors: timeout, bad_framing.
author::Procedure scan(Dialog& dialog, Nodes& nodes);

/// Result of `configure`: the values that it reports, and the nodes that were on the bus before the setting was sent.
struct ConfigureResult : Values {
  Nodes nodes{};          ///< Nodes that were found on the bus before the setting was sent.
  bool verified = false;  ///< Whether the host has verified that the node obeys the setting.
};

/// Changes the node number (order 11) or the bit rate (order 13) of the only node on the bus. Errors: invalid_argument,
/// unexpected_reply, timeout, bad_framing, request_rejected, cross_check_failed.
author::Procedure configure(Dialog& dialog, ConfigureResult& found, Order order, Arguments arguments);

}  // namespace absenc::raa38::can
