// SPDX-License-Identifier: Apache-2.0
// Names and meanings of the fields of a BiSS frame that are not in its position word.
#pragma once

#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// Values of a BiSS frame that are not in its position word.
struct FrameValues {
  unsigned ack_bits;           ///< Number of ACK bits: clocks until the encoder was ready.
  unsigned crc;                ///< CRC as the encoder sends it.
  unsigned life_counter;       ///< Life counter, 0 to 63.
  unsigned line_delay_clocks;  ///< Delay of the line there and back, in whole clocks.
  double line_delay_us;        ///< Delay of the line there and back, in microseconds.
};

/// Fields in which FrameValues are reported.
inline constexpr auto frame_fields = author::fields_of<FrameValues>(
    author::field<&FrameValues::ack_bits>("ack_bits", "", "clocks until the encoder was ready"),
    author::field<&FrameValues::crc>("crc", "", "as sent: inverted"),
    author::field<&FrameValues::life_counter>("life_counter", "", "counts up with every frame (BiSS Safety)",
                                              Role::life_counter),
    author::field<&FrameValues::line_delay_clocks>("line_delay_clocks", "",
                                                   "whole clocks by which the line is late, there and back"),
    author::field<&FrameValues::line_delay_us>("line_delay_us", "us",
                                               "the same at the clock of ma_khz: 100 m of cable make 1 us"));

/// Puts the delay of the line into `sink`; nothing if it is less than a clock.
template <class F, class ReplyType>
constexpr void put_line_delay(FieldSink& sink, const F& format, const ReplyType& reply) {
  if (reply.delay_bits == 0) return;
  frame_fields.put<&FrameValues::line_delay_clocks>(sink, reply.delay_bits);
  frame_fields.put<&FrameValues::line_delay_us>(sink, reply.delay_bits * 1000.0 / format.ma_khz);
}

}  // namespace absenc::biss
