// SPDX-License-Identifier: Apache-2.0
// The RAA38S6 on CAN, as a host talks to it.
#pragma once

#include "absenc/protocol/author/can_line.hpp"
#include "absenc/protocol/raa38/can/frame.hpp"

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

  static constexpr author::CanWire wire(const Format&) { return {answer_limit, busy_limit}; }
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

/// One position: asked for (80, 01), or the next that the node sends by itself.
class Read : public author::CanEngine {
 public:
  enum class Way : std::uint8_t { ask, start, listen };
  Read(const Format& format, Way way);

  [[nodiscard]] const Format& format() const { return format_; }
  [[nodiscard]] const Reading& found() const { return reading_; }
  [[nodiscard]] const Reading* reading() const final { return error() == Error::none ? &reading_ : nullptr; }

 private:
  void heard(const CanFrame& frame, Time at) final;
  void over() final;

  Format format_;
  Way way_;
  bool only_extended_ = false;  // where the reply should have been
  Reading reading_{};
};

/// The frame by which a node is asked for its position; of `listen`, what asks it once.
[[nodiscard]] constexpr CanFrame position_request(const Format& format, Read::Way way) {
  return encode_command(format.node, way == Read::Way::start ? command::start : command::read);
}

}  // namespace absenc::raa38::can
